"""Event files that TensorBoard reads, in the run's folder."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from pathlib import Path

from google.protobuf.message import DecodeError
from tensorboardX import FileWriter
from tensorboardX.proto.event_pb2 import Event
from tensorboardX.proto.summary_pb2 import Summary

FOLDER, FILES = "tensorboard", "events.out.tfevents.*"
HEAD, TAIL = 12, 4  # bytes around a record: its length and that length's checksum; its own checksum


class Tensorboard:
    """Writes one event an epoch; each start of the run has a file of its own."""

    def __init__(self, folder: Path) -> None:
        """Opens the files of the run in ``folder``."""
        self.place = folder / FOLDER
        self.before = dict(last_epochs(self.place))
        starts = len(list(self.place.glob(FILES)))  # two within a second would else write the same file
        self.writer = FileWriter(str(self.place), filename_suffix=f".{starts}")

    def last(self) -> Mapping[str, int]:
        """Returns the last epoch of each figure that the files hold."""
        return self.before

    def write(self, epoch: int, figures: Mapping[str, float]) -> None:
        """Adds an event with all ``figures`` of an epoch."""
        values = [Summary.Value(tag=name, simple_value=value) for name, value in figures.items()]
        self.writer.add_summary(Summary(value=values), epoch)

    def flush(self) -> None:
        """Writes what waits to be written."""
        self.writer.flush()

    def close(self, ended: str) -> None:
        """Ends the file."""
        self.writer.close()


def last_epochs(place: Path) -> dict[str, int]:
    """Returns the last epoch of each figure in the event files under ``place``."""
    last: dict[str, int] = {}
    for path in sorted(place.glob(FILES)):
        for event in events(path):
            for value in event.summary.value:
                last[value.tag] = max(event.step, last.get(value.tag, -1))
    return last


def events(path: Path) -> Iterator[Event]:
    """Yields the events of a file, as far as they are whole: whoever kills a run leaves half of one."""
    content, at = path.read_bytes(), 0
    while at + HEAD <= len(content):
        (size,) = struct.unpack_from("<Q", content, at)
        if at + HEAD + size + TAIL > len(content):
            return
        try:
            yield Event.FromString(content[at + HEAD : at + HEAD + size])
        except DecodeError:
            return
        at += HEAD + size + TAIL

"""Forgets compiled kernels when any source changed.

Numba keeps compiled functions on disk and compiles one again when its own file changed, but not when a
function that it calls, in another file, did: after an edit the old rule would go on being played.
"""

import contextlib
import hashlib
import os
from pathlib import Path

STAMP = "sources.sha256"


def forget_stale(package_dir: str | Path, *more_dirs: str | Path) -> None:
    """Deletes the compiled functions of a package unless they are of the sources that are there now.

    Does nothing where the folder cannot be written. Compiled code elsewhere (NUMBA_CACHE_DIR) is not known here.

    Args:
        package_dir: folder of the package; its ``__pycache__`` holds the compiled functions and the stamp.
        more_dirs: folders of other packages whose functions the package's compiled functions call.
    """
    sources = sorted(source for folder in (package_dir, *more_dirs) for source in Path(folder).glob("*.py"))
    compiled = Path(package_dir) / "__pycache__"
    stamp = compiled / STAMP
    with contextlib.suppress(OSError):
        digest = hashlib.sha256()
        for source in sources:
            digest.update(source.name.encode() + b"\0" + source.read_bytes() + b"\0")
        if stamp.exists() and stamp.read_text() == digest.hexdigest():
            return
        compiled.mkdir(exist_ok=True)
        for pattern in ("*.nbi", "*.nbc"):
            for old in compiled.glob(pattern):
                old.unlink(missing_ok=True)
        fresh = stamp.with_suffix(f".{os.getpid()}")
        fresh.write_text(digest.hexdigest())
        fresh.replace(stamp)

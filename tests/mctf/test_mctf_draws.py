import numpy as np

from mctf.draws import next_bits, next_uniform, seed_of

# The first numbers of the reference splitmix64.c by Vigna, seeds 0 and 1234567
REFERENCE = {
    0: [0xE220A8397B1DCDAF, 0x6E789E6AA1B965F4, 0x06C45D188009454F, 0xF88BB8A8724C81EC],
    1234567: [6457827717110365317, 3203168211198807973, 9817491932198370423, 4593380528125082431],
}


def test_reference_numbers():
    streams = np.array(list(REFERENCE), np.uint64)
    for b, numbers in enumerate(REFERENCE.values()):
        assert [next_bits(streams, b) for _ in numbers] == numbers


def test_uniform_is_the_upper_53_bits():
    streams = np.zeros(1, np.uint64)
    assert next_uniform(streams, 0) == (0xE220A8397B1DCDAF >> 11) / 2**53
    draws = np.array([next_uniform(streams, 0) for _ in range(20_000)])
    assert draws.min() >= 0.0
    assert draws.max() < 1.0
    np.testing.assert_allclose(np.bincount((draws * 17).astype(int), minlength=17) / 20_000, 1 / 17, atol=0.007)


def test_seeds_differ():
    keys = [0, 1, 2**63, 2**64 - 1]
    seeds = {int(seed_of(np.uint64(key), np.uint64(index))) for key in keys for index in range(1000)}
    assert len(seeds) == 4000


def test_seed_is_a_place_in_a_stream():
    key = np.uint64(0x9E3779B97F4A7C15)  # mixed, it is the first number of stream 0
    stream = np.array([REFERENCE[0][0]], np.uint64)
    assert [seed_of(key, np.uint64(i)) for i in range(4)] == [next_bits(stream, 0) for _ in range(4)]

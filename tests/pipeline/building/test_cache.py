"""The stage cache: what it returns is what would be computed, and what is damaged is computed again."""

import os
import resource
import time

import numpy as np
import pytest
from bad.good import BEAM
from scipy.sparse import csr_array

import modalprep as mp
from modalprep.errors import AccuracyError
from modalprep.examples import cantilever_model
from modalprep.pipeline.building import cache as cache_module
from modalprep.pipeline.building import stages
from modalprep.pipeline.building.build import build_body
from modalprep.pipeline.building.cache import Cache
from modalprep.pipeline.building.stages import caching_algebra
from modalprep.pipeline.console import Reporter

SQUARE = {"y": np.array([0.0, 1.0, 4.0])}
FIELDS = ("frequency", "K", "D", "P", "S", "H", "Kg_A", "Kg_W", "Kg_F", "Kg_T", "phi", "psi", "shape")


@pytest.fixture
def cache(tmp_path):
    return Cache(tmp_path / "cache")


@pytest.fixture
def job(project, tmp_path):
    """Write the beam's pipeline file with another value of what the options say."""

    def write(name="beam", **options):
        text = BEAM.replace("beam.msh", str(project / "meshes" / "beam.msh"))
        text = text.replace("modes = 3", "\n".join(f"{key} = {value}" for key, value in options.items()))
        (tmp_path / f"{name}.toml").write_text('name = "beam"\n' + text)
        return tmp_path / f"{name}.toml"

    return write


def entries(cache):
    return sorted(cache.folder.glob("*.stage"))


def held(cache):
    """Bytes of all files of a cache."""
    return sum(file.stat().st_size for file in cache.folder.rglob("*") if file.is_file())


def build(file, cache):
    return build_body(file, file.parent / "output" / file.stem, Reporter(quiet=True), cache)


def refuse(*args, **kwargs):
    raise AssertionError("computed again")


def test_keys_tell_content_apart(cache):
    """Equal content has equal keys, however a matrix is stored; anything else differs."""
    A = csr_array(np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, 0.0], [0.0, 0.0, 1.0]]))
    unsorted = csr_array((A.data[[1, 0, 2, 3, 4]], A.indices[[1, 0, 2, 3, 4]], A.indptr), shape=A.shape)
    assert not unsorted.has_sorted_indices
    assert cache.key("K", A) == cache.key("K", unsorted) == cache.key("K", A.copy())
    b = np.arange(6.0)
    parts = [
        (A,),
        (2 * A,),
        ("K", A),
        (b,),
        (b.reshape(2, 3),),
        (b.reshape(3, 2),),
        (b.astype(int),),
        ("b", 1),
        ("b1",),
    ]
    parts += [(csr_array(A.toarray()[:, :2]),), (csr_array((3, 3)),), (csr_array((3, 4)),), (1, 2), (12,), ([1], 2)]
    assert len({cache.key(*part) for part in parts}) == len(parts)


def test_another_program_finds_nothing(cache, monkeypatch):
    cache.write(cache.key("square"), SQUARE, 1.0)
    assert cache.read(cache.key("square")) is not None
    monkeypatch.setattr(cache_module, "program", lambda: {"modalprep": "0.0.1"})
    assert cache.read(cache.key("square")) is None


@pytest.mark.parametrize("place", [0, 5, 30, 90, 200, -1])
def test_a_damaged_entry_is_computed_again(cache, place):
    """One bit wrong anywhere: in the mark, the checksum, the arrays."""
    key = cache.key("square")
    cache.write(key, SQUARE, 1.0)
    (file,) = entries(cache)
    data = bytearray(file.read_bytes())
    data[place] ^= 1
    file.write_bytes(data)
    assert cache.read(key) is None
    assert not file.exists()
    assert np.array_equal(cache.recall(key, lambda: SQUARE)["y"], SQUARE["y"])
    assert cache.use.computed == 1
    assert np.array_equal(cache.recall(key, refuse)["y"], SQUARE["y"])


@pytest.mark.parametrize("length", [0, 10, 60, 100, 300])
def test_a_short_entry_is_computed_again(cache, length):
    key = cache.key("square")
    cache.write(key, SQUARE, 1.0)
    (file,) = entries(cache)
    file.write_bytes(file.read_bytes()[:length])
    assert cache.read(key) is None


def test_an_entry_serves_under_its_own_name_only(cache):
    first, second = cache.key("first"), cache.key("second")
    cache.write(first, SQUARE, 1.0)
    entries(cache)[0].rename(cache.folder / f"{second}.stage")
    assert cache.read(second) is None


def test_nothing_is_executed(cache):
    """An array of objects, which numpy would unpickle, is refused even under a valid checksum."""
    key = cache.key("objects")

    class Trap:
        def __reduce__(self):
            return os.mkdir, (str(cache.folder / "executed"),)

    cache.write(key, {"y": np.array([Trap()], dtype=object)}, 1.0)
    assert len(entries(cache)) == 1
    assert cache.read(key) is None
    assert not (cache.folder / "executed").exists()


def test_size_is_bounded(cache):
    """The entries that were not used for longest go; one that is too large is not stored."""
    small = Cache(cache.folder, limit=110_000)
    keys = [small.key(k) for k in range(6)]
    for age, key in enumerate(keys[:4]):
        small.write(key, {"y": np.zeros(3000)}, 1.0)  # 24 kB each
        os.utime(small.folder / f"{key}.stage", (age, age))
    assert small.read(keys[0]) is not None  # used now
    small.write(keys[4], {"y": np.zeros(3000)}, 1.0)
    kept = [small.read(key) is not None for key in keys[:5]]
    assert kept == [True, False, True, True, True]
    assert held(small) <= 110_000
    small.write(keys[5], {"y": np.zeros(20_000)}, 1.0)
    assert small.read(keys[5]) is None
    assert small.read(keys[4]) is not None


@pytest.mark.parametrize("damage", [None, b"", b"lost", bytes(24)])
def test_the_limit_is_kept_by_all_writers_together(cache, monkeypatch, damage):
    """Two programs in turn, after each write and before each entry is in its place, whatever happened to the sizes."""
    writers, sizes = [Cache(cache.folder, limit=100_000), Cache(cache.folder, limit=100_000)], []
    replace = os.replace
    monkeypatch.setattr("modalprep.atomic.os.replace", lambda *paths: (sizes.append(held(cache)), replace(*paths)))
    for k in range(30):
        writers[k % 2].write(cache.key(k), {"y": np.zeros(10 * k**2)}, 1.0)
        sizes.append(held(cache))
        if damage is not None and k % 7 == 0:
            (cache.folder / "sizes").write_bytes(damage)
    assert max(sizes) <= 100_000
    assert max(sizes) > 80_000
    assert cache.read(cache.key(29)) is not None


def test_an_entry_in_the_making_counts(cache, monkeypatch):
    """While one program has recorded an entry that is not in its place, another writes: both are within the limit."""
    other, replace = Cache(cache.folder, limit=100_000), os.replace
    cache = Cache(cache.folder, limit=100_000)
    cache.write(cache.key("old"), {"y": np.zeros(5000)}, 1.0)

    def late(source, target):
        monkeypatch.setattr("modalprep.atomic.os.replace", replace)
        other.write(other.key("other"), {"y": np.zeros(5000)}, 1.0)
        assert held(cache) <= 100_000
        replace(source, target)

    monkeypatch.setattr("modalprep.atomic.os.replace", late)
    cache.write(cache.key("new"), {"y": np.zeros(5000)}, 1.0)
    assert held(cache) <= 100_000
    assert [cache.read(cache.key(name)) is not None for name in ("old", "other", "new")] == [False, True, True]


def test_writes_do_not_list_the_folder(cache, monkeypatch):
    """It is listed for the first entry of all, and then when the recorded sizes reach the limit: each time 5 % go."""
    listed, scandir = [], os.scandir
    monkeypatch.setattr(os, "scandir", lambda path: listed.append(str(path)) or scandir(path))
    monkeypatch.setattr("pathlib.Path.iterdir", lambda path: pytest.fail(f"{path} is listed"))
    for k in range(50):
        Cache(cache.folder).write(cache.key(k), SQUARE, 1.0)
    assert listed.count(str(cache.folder)) == 1
    size = held(cache) / 50
    for k in range(50, 250):
        Cache(cache.folder, limit=150 * size).write(cache.key(k), SQUARE, 1.0)
    assert 2 <= listed.count(str(cache.folder)) <= 1 + 200 / 7


def test_what_a_killed_writer_left_goes_too(cache):
    cache.folder.mkdir()
    left = cache.folder / ".abc.17.part.stage"
    left.write_bytes(bytes(90_000))
    os.utime(left, (1, 1))
    small = Cache(cache.folder, limit=100_000)
    small.write(small.key(1), {"y": np.zeros(3000)}, 1.0)
    assert not left.exists()
    assert small.read(small.key(1)) is not None


def test_a_folder_that_cannot_be_written_costs_only_time(tmp_path):
    (tmp_path / "file").write_text("")
    cache = Cache(tmp_path / "file" / "cache")
    for _ in range(2):
        assert np.array_equal(cache.recall(cache.key("square"), lambda: SQUARE)["y"], SQUARE["y"])
    assert (cache.use.found, cache.use.computed) == (0, 2)


def test_a_full_disk_costs_only_time(cache):
    """Files may have 200 bytes: what was computed is returned, and no half of it stays."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (200, before[1]))
    try:
        for _ in range(2):
            assert np.array_equal(cache.recall(cache.key("square"), lambda: SQUARE)["y"], SQUARE["y"])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert (cache.use.found, cache.use.computed) == (0, 2)
    assert held(cache) == 0


def test_savings_are_counted(cache):
    key = cache.key("slow")
    cache.recall(key, lambda: time.sleep(0.05) or SQUARE)
    cache.recall(key, refuse)
    assert cache.use.found == cache.use.computed == 1
    assert cache.use.saved_seconds >= 0.05


@pytest.fixture
def model():
    return cantilever_model(100, tip="fixed")  # 594 DOFs inside: Lanczos and a sparse factor


def test_arrays_without_entries_have_keys(cache):
    """An array of no entries has a key of its own, by its shape."""
    keys = {cache.key(np.zeros(shape)) for shape in ((0,), (3, 0), (0, 3), (1,))}
    assert len(keys) == 4


@pytest.mark.parametrize("reduce", [mp.craig_bampton, mp.reduction.free_interface])
def test_reductions_come_back_to_the_last_bit(cache, model, monkeypatch, reduce):
    """Nothing is factorised the second time; each array is the one computed without a cache."""
    plain, first = reduce(model, modes=8), reduce(model, modes=8, algebra=caching_algebra(cache))
    monkeypatch.setattr(stages, "DIRECT", None)
    for found in (first, reduce(model, modes=8, algebra=caching_algebra(cache))):
        assert np.array_equal(found.basis, plain.basis)
        assert np.array_equal(found.static, plain.static)
        assert np.array_equal(found.frequency, plain.frequency)


def test_fewer_modes_need_no_factor(cache, model, monkeypatch):
    """They are the lowest of those stored: the eigensolver's tolerance, 1e-10 of w^2, is all that differs."""
    mp.craig_bampton(model, modes=12, truncation=(), algebra=caching_algebra(cache))
    monkeypatch.setattr(stages, "DIRECT", None)
    fewer = mp.craig_bampton(model, modes=5, truncation=(), algebra=caching_algebra(cache))
    alone = mp.craig_bampton(model, modes=5, truncation=())
    assert np.allclose(fewer.frequency, alone.frequency, rtol=1e-9, atol=0)
    overlap = np.abs(fewer.basis.T @ (model.M @ alone.basis))
    assert np.allclose(np.linalg.svd(overlap)[1], 1, atol=1e-7)  # the same space


def test_more_modes_are_computed(cache, model):
    mp.craig_bampton(model, modes=5, algebra=caching_algebra(cache))
    more = mp.craig_bampton(model, modes=12, algebra=caching_algebra(cache))
    assert np.array_equal(more.basis, mp.craig_bampton(model, modes=12).basis)


def test_measured_errors_come_back(cache, model, monkeypatch):
    reduction = mp.craig_bampton(model, modes=8)
    plain = mp.reduction.reduction_error(model, reduction, up_to=50.0)
    mp.reduction.reduction_error(model, reduction, up_to=50.0, algebra=caching_algebra(cache))
    monkeypatch.setattr(stages, "DIRECT", None)
    found = mp.reduction.reduction_error(model, reduction, up_to=50.0, algebra=caching_algebra(cache))
    assert np.array_equal(found.full, plain.full)
    assert np.array_equal(found.dynamic, plain.dynamic)


def test_a_singular_matrix_is_refused_each_time(cache):
    A = csr_array(np.array([[1.0, -1.0], [-1.0, 1.0]]))
    for _ in range(2):
        with pytest.raises(AccuracyError, match="singular"):
            caching_algebra(cache).factorise(A, "superlu")
    assert entries(cache) == []


def test_bodies_come_back(cache, job):
    """Modal file, checks, notes and measured error; only the name of the pipeline file is that of the second."""
    file = job(modes=3, up_to=20.0)
    file.write_text(file.read_text() + '\n[recovery.base]\nkind = "reaction"\n')
    plain, first = build(file, None), build(file, cache)
    again = build(file.rename(file.with_name("renamed.toml")), cache)
    assert cache.use.saved_seconds > 0
    for name in FIELDS:
        assert np.array_equal(getattr(again.body, name), getattr(plain.body, name)), name
    assert again.checks == first.checks == plain.checks
    assert again.notes == first.notes == plain.notes
    assert np.array_equal(again.error.dynamic, plain.error.dynamic)
    assert again.error.recoveries == again.convergence.recoveries == ("base",)
    assert np.array_equal(again.error.recovery, plain.error.recovery)
    assert np.array_equal(again.convergence.error, plain.convergence.error)
    assert again.convergence.methods == plain.convergence.methods
    assert again.body.provenance == plain.body.provenance | {"pipeline": "renamed.toml"}
    assert mp.read_body(again.file).provenance == again.body.provenance


@pytest.mark.parametrize("change", [{"modes": 2}, {"modes": 3, "damping": 0.02}, {"modes": 3, "keep": [1, 2]}])
def test_another_option_is_another_body(cache, job, change):
    build(job(modes=3), cache)
    changed = job("changed", **change)
    found, plain = build(changed, cache), build(changed, None)
    for name in FIELDS:
        assert np.allclose(getattr(found.body, name), getattr(plain.body, name), rtol=1e-9, atol=1e-9), name


def test_another_mesh_is_another_body(cache, project, tmp_path, job):
    file = job(modes=3)
    mesh = tmp_path / "own.msh"
    text = (project / "meshes" / "beam.msh").read_text()
    mesh.write_text(text)
    file.write_text(file.read_text().replace(str(project / "meshes" / "beam.msh"), "own.msh"))
    before = build(file, cache).body
    mesh.write_text(text.replace("10 0 0", "11 0 0"))
    assert build(file, cache).body.m == pytest.approx(1.1 * before.m)

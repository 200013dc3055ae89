"""Records of arrays that compiled code takes as one pointer.

Numba hands a tuple of arrays to a function number by number: hundreds of arguments, in every call, for the equations
of a system. A record of a class with `by_address` is the address of a block of words instead, which holds where each
array lies, its shape and strides, the addresses of the records inside, and numbers. The block is written once, at the
first call, and never changes: compiled code may keep what it has read of it. Records that are made again and again are
copies of a `Pattern`.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from ctypes import c_void_p
from itertools import accumulate
from struct import pack, unpack
from typing import Any, ClassVar, Generic, NamedTuple, TypeVar

import numpy as np

from modalprep.compiler.sizes import WORD as WORD

# of all arrays alike: the attributes of a recarray take ten times as long
SHAPE, STRIDES = np.ndarray.shape.__get__, np.ndarray.strides.__get__
DTYPE = np.ndarray.dtype.__get__
NDIM = np.ndarray.ndim.__get__
FLAGS = np.ndarray.flags.__get__
ROWS, COLUMNS, ORDER = 0x0001, 0x0002, 0x0503  # flags of an array that make its type: order, aligned, writeable
LINE = 64  # bytes, of the processor's cache
Named = TypeVar("Named", bound=NamedTuple)


class Layout:
    """What a record is like: its fields as `written`, and the first word of each."""

    def __init__(self, name: str, fields: dict[str, str], words: Sequence[int]) -> None:
        self.fields = fields
        self.first = dict(zip(fields, accumulate(words, initial=0), strict=False))
        self.name = f"{name}_{hashlib.sha256(repr(fields).encode()).hexdigest()[:12]}"


def _data(array: np.ndarray) -> int:
    """Return where the numbers of an array lie, which follows the object's head; `ctypes` takes ten times as long."""
    return c_void_p.from_address(id(array) + object.__basicsize__).value or 0


class _Lazy:
    """A field of a copy of a `Pattern`: its array is made when it is asked for, and stays with the record."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __get__(self, record: Addressed | None, owner: type) -> Any:
        if record is None:
            return self
        kind, shape, dtype, first = record._places[self.name]
        record.__dict__[self.name] = array = np.ndarray.__new__(kind, shape, dtype, record._block, first)
        return array


class _Once:
    """A property that is found once, as `functools.cached_property`, but without the lock that its records share.

    The words of a record need the addresses of those inside, and an address needs the words: two threads would wait for
    each other. Both find a value instead, and keep the same one.
    """

    def __init__(self, find: Callable[[Any], Any]) -> None:
        self.find = find

    def __get__(self, record: Addressed | None, owner: type) -> Any:
        if record is None:
            return self
        return record.__dict__.setdefault(self.find.__name__, self.find(record))


class Addressed:
    """What `by_address` makes of a NamedTuple: a record of the same fields, which do not change."""

    _named: ClassVar[Any]  # the NamedTuple
    _fields: ClassVar[tuple[str, ...]]
    _places: dict[str, tuple[Any, ...]]  # of a copy of a `Pattern`: class, shape, dtype and first byte of its arrays
    _block: np.ndarray

    def __init__(self, *values: Any, **named: Any) -> None:
        self.__dict__.update(zip(self._fields, self._named(*values, **named), strict=True))

    def __iter__(self) -> Iterator:
        return iter([getattr(self, name) for name in self._fields])

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"{type(self).__name__}.{name} cannot be exchanged, what it holds may change")

    def __index__(self) -> int:
        return self._address

    def __reduce__(self) -> tuple:
        """Copies and pickles have blocks of their own."""
        return type(self), tuple(self)

    def _replace(self, **changes: Any) -> Any:
        return type(self)(**(dict(zip(self._fields, self, strict=True)) | changes))

    @_Once
    def _words(self) -> np.ndarray:
        words: list[int] = []
        for value in self:
            if isinstance(value, np.ndarray):
                words += (_data(value), *SHAPE(value), *STRIDES(value))
            elif isinstance(value, Addressed):
                words.append(value._address)
            elif isinstance(value, float):
                words.append(unpack("q", pack("d", value))[0])
            elif value is not None:
                words.append(int(value))
        return np.array(words, dtype=np.int64)

    @_Once
    def _address(self) -> int:
        return _data(self._words)

    @_Once
    def _type(self) -> Layout:
        key = type(self), *map(layout, self)
        if key not in LAYOUTS:
            fields = {name: written(value) for name, value in zip(self._fields, self, strict=True)}
            LAYOUTS[key] = Layout(type(self).__name__, fields, [*map(_count, self)])
        return LAYOUTS[key]

    @property
    def _numba_type_(self) -> Any:
        from modalprep.compiler.address_code import type_of

        return type_of(self)


LAYOUTS: dict[tuple[Any, ...], Layout] = {}  # by class and layout of the fields


def layout(value: Any) -> Any:
    """Return what the type of an argument or a field depends on."""
    if isinstance(value, np.ndarray):
        order = FLAGS(value).num & ORDER
        return DTYPE(value), NDIM(value), order - COLUMNS if order & ROWS and order & COLUMNS else order
    if isinstance(value, Addressed):
        return value._type.name
    if isinstance(value, tuple):
        return type(value), *map(layout, value)
    return value.dtype if isinstance(value, np.void) else type(value)


def written(value: Any) -> str:
    """Return the type of an argument or a field as text, the same in every process.

    Examples
    --------
    >>> written(1.0), written(True), written(None), written((1, 2.0))
    ('float64', 'bool', 'NoneType', 'tuple(int64, float64)')
    """
    if isinstance(value, np.ndarray):
        dtype, ndim, order = layout(value)
        return f"{dtype} {ndim} {order}"
    if isinstance(value, Addressed):
        return value._type.name
    if isinstance(value, tuple):
        return f"{type(value).__name__}({', '.join(map(written, value))})"
    if isinstance(value, np.void):  # a row of a table
        return str(value.dtype)
    return KNOWN.get(type(value), type(value).__name__)


KNOWN = {int: "int64", float: "float64", np.bool_: "bool"}


def _count(value: Any) -> int:
    """Return how many words of the block a field takes."""
    if isinstance(value, np.ndarray):
        return 1 + 2 * value.ndim
    return 0 if value is None else 1


class Pattern(Generic[Named]):
    """A record from which others are made at once: its arrays lie in one block of memory, and are copied with it.

    Numbers and the records inside are shared, where no others are given.

    Parameters
    ----------
    record : record of a class with `by_address`
        What the copies are like.
    given : sequence of str
        Arrays that every copy is given.

    Examples
    --------
    >>> from typing import NamedTuple
    >>> @by_address
    ... class Line(NamedTuple):
    ...     slope: float
    ...     points: np.ndarray  # (n,)
    >>> line = Pattern(Line(2.0, np.ones(3)))
    >>> one, two = line.copy(), line.copy()
    >>> one.points[0] = 5.0
    >>> one.points, two.points
    (array([5., 1., 1.]), array([1., 1., 1.]))
    """

    def __init__(self, record: Named, given: Sequence[str] = ()) -> None:
        addressed: Any = record  # a NamedTuple for type checkers alone
        self.kind = type(record)
        self.type: Layout = addressed._type
        size = 0
        self.places: dict[str, tuple[Any, ...]] = {}
        fields = dict(zip(record._fields, record, strict=True))
        self.layouts = {name: layout(value) for name, value in fields.items()}
        self.others = {name: value for name, value in fields.items() if not isinstance(value, np.ndarray)}
        own = {name: x for name, x in fields.items() if name not in self.others and name not in given}
        for name, array in own.items():
            self.places[name] = type(array), array.shape, array.dtype, size
            size += -(-array.nbytes // LINE) * LINE
        self.block = np.zeros(size + LINE, dtype=np.uint8)
        arrays = {}
        for name, (kind, shape, dtype, first) in self.places.items():
            arrays[name] = np.ndarray.__new__(kind, shape, dtype, self.block, first)
            if np.ascontiguousarray(own[name]).reshape(-1).view(np.uint8).any():  # zeros not written take no memory
                arrays[name][...] = own[name]
        self.words: np.ndarray = addressed._replace(**arrays)._words.copy()
        self.moves = np.zeros_like(self.words)
        addresses = [self.type.first[name] for name in own]
        self.words[addresses] -= _data(self.block)
        self.moves[addresses] = 1

    def copy(self, **others: Any) -> Named:
        """Return a record whose arrays hold what those of the pattern held, with other records and arrays if given.

        Raises
        ------
        TypeError
            When one of these has another type, or an array another order in memory.
        """
        found = object.__new__(self.kind)
        memory = np.empty(len(self.block) + LINE, dtype=np.uint8)
        begin = -_data(memory) % LINE  # vectors of four numbers that lie in two lines are read and written slowly
        block = memory[begin : begin + len(self.block)]
        block[:] = self.block
        words = self.words + _data(block) * self.moves
        first = self.type.first
        for name, value in others.items():
            if layout(value) != self.layouts[name]:
                raise TypeError(f"{self.kind.__name__}.{name} has another layout than that of the pattern")
            if isinstance(value, Addressed):
                words[first[name]] = value._address
            else:
                numbers = _data(value), *SHAPE(value), *STRIDES(value)
                words[first[name] : first[name] + len(numbers)] = numbers
        found.__dict__.update(
            self.others,
            **others,
            _block=block,
            _places=self.places,
            _words=words,
            _address=_data(words),
            _type=self.type,
        )
        return found


def by_address(cls: type[Named]) -> type[Named]:
    """Return a NamedTuple of arrays, numbers, records and None whose values kernels take as one pointer.

    Kernels read its fields and cannot make one. Its arrays cannot be exchanged; what they hold may change.

    Examples
    --------
    >>> from typing import NamedTuple
    >>> from modalprep.compiler.jit import compile_kernel
    >>> @by_address
    ... class Line(NamedTuple):
    ...     slope: float
    ...     points: np.ndarray  # (n,)
    >>> @compile_kernel
    ... def rise(line, k):
    ...     return line.slope * line.points[k]
    >>> rise(Line(2.0, np.array([1.0, 3.0])), 1)
    6.0
    """
    made: Any = type(
        cls.__name__,
        (Addressed,),
        {
            "__module__": cls.__module__,
            "__qualname__": cls.__qualname__,
            "__doc__": cls.__doc__,
            "__annotations__": cls.__annotations__,
            "_named": cls,
            "_fields": cls._fields,
            **{name: _Lazy(name) for name in cls._fields},
        },
    )
    return made

"""What a field of a description holds: a quantity within a range, a whole number, one of some names.

A field states it in its annotation, ``Annotated[Quantity, Measure("length", above=0)]``; pydantic reads values by it,
whether the field is one of a case or of a dataclass that is `gearmbs.schema.described.Described`.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, is_dataclass
from functools import cached_property, lru_cache
from numbers import Real
from typing import TYPE_CHECKING, Any, get_args

from gearmbs.units import DIMENSIONS, si_unit, to_si, truth
from gearmbs.wording import any_of

if TYPE_CHECKING:
    from pydantic import GetCoreSchemaHandler
    from pydantic_core import CoreSchema

SHOWN = {"mm": 1e-3, "deg": math.pi / 180.0, "rpm": math.pi / 30.0, "GPa": 1e9}
"""Units of messages that are not SI, and what they are in SI."""

ROUNDING = 1e-12
"""Share of a limit by which a value may be beyond it: a limit in mm and a value in um differ by less in SI."""


class OutOfRange(ValueError):
    """A number that its field cannot have.

    Attributes
    ----------
    said : str
        The message with the number in front: "-1 mm; it must be positive".
    """

    def __init__(self, message: str, said: str) -> None:
        super().__init__(message)
        self.said = said


class NoQuantity(ValueError):
    """What is no quantity of its field's kind; the message begins with what was given."""


@dataclass(frozen=True)
class Measure:
    """What a field measures, between which limits.

    Attributes
    ----------
    dimension : str
        One of `gearmbs.units.DIMENSIONS`, or an SI unit.
    low, high : float, optional
        Limits, included, in ``shown``.
    shown : str
        Unit of the limits and of messages; default the SI unit.
    above, below : float, optional
        Limits, not included.
    remedy : str
        What messages ask for; default: the limits.
    whole : bool
        Whether it is a whole number.
    several : int, optional
        How many values there are, in a list that becomes a tuple; 0: any number; -2: two or more. Default: one value,
        no list.
    each : bool
        Whether driver and driven may have values of their own, as a list of two.
    curve : bool
        Whether the value may be a curve, as a list of points (time, value); zero is possible there.
    word : str
        A text that may stand in place of a quantity, such as "auto".
    """

    dimension: str = "dimensionless"
    low: float | None = None
    high: float | None = None
    shown: str = ""
    above: float | None = None
    below: float | None = None
    remedy: str = ""
    whole: bool = False
    several: int | None = None
    each: bool = False
    curve: bool = False
    word: str = ""

    @cached_property
    def unit(self) -> str:
        """The SI unit the field holds."""
        unit = DIMENSIONS.get(self.dimension, self.dimension)
        return "1" if unit == "dimensionless" else unit.replace("*", " ")

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        from pydantic_core import core_schema

        if source in (Any, int) or self.several is not None:
            return core_schema.no_info_plain_validator_function(self.as_given)
        return core_schema.no_info_before_validator_function(self.read, handler(source))

    def as_given(self, value: Any) -> Any:
        """Return the value in SI, a `gearmbs.units.Given` of a text.

        Raises
        ------
        ValueError
            For a wrong unit, a value outside the limits and one that is not finite.
        """
        if self.several is None:
            return self._finite(value)
        count = f"{abs(self.several)}{' or more' if self.several < 0 else ''}"
        asked = f"give a list of {count} values" if self.several else "give a list"
        if isinstance(value, str) or not isinstance(value, Iterable):
            raise ValueError(asked)
        found = tuple(map(self._finite, value))
        if len(found) != self.several > 0 or len(found) < -self.several:
            raise ValueError(asked)
        return found

    def _finite(self, value: Any) -> Any:
        if getattr(value, "shape", None) == () and not hasattr(value, "units"):
            # an array of one number
            value = value.item()
        number = isinstance(value, Real) and not isinstance(value, bool)
        asked = self.remedy or "give a finite number"
        if number and not math.isfinite(value):
            raise OutOfRange(asked, f"{value}; {asked}")
        try:
            if not self.whole:
                found = self._one(value)
                if math.isinf(found):
                    raise OutOfRange(asked, f"{value!r}; {asked}")
                return found
            if number and value == int(value):
                return self._one(int(value))
            raise NoQuantity
        except NoQuantity:
            if self.whole or self.remedy or self.unit == "1":
                raise OutOfRange(self._range, f"{value!r}; {self._range}") from None
            raise

    def read(self, value: Any) -> Any:
        """Return the value as a plain number in SI, or for a list of two both.

        Raises
        ------
        ValueError
            For a wrong unit or a value outside the limits.
        """
        if value is None or (self.word and isinstance(value, str) and value.strip().lower() == self.word):
            return value if value is None else self.word
        if self.each and isinstance(value, Sequence) and not isinstance(value, str):
            return tuple(float(self._one(item)) for item in two(value))
        if self.curve and isinstance(value, Sequence) and not isinstance(value, str):
            return self._points(value)
        return float(self._one(value))

    def _points(self, value: Sequence) -> tuple[tuple[float, float], ...]:
        """Return the points of a curve in s and SI."""
        points: list[tuple[float, float]] = []
        for place, point in enumerate(value, 1):
            if isinstance(point, str) or not isinstance(point, Sequence) or len(point) != 2:
                raise ValueError(
                    f"a curve is a list of points [time, value] such as [['0 s', '0 {self.shown or self.unit}'], "
                    f"['2 s', ...]]; point {place} is {point!r}"
                )
            try:
                time = in_si(point[0], "time")
                zero = in_si(point[1], self.dimension) == 0.0
            except ValueError as error:
                raise ValueError(f"point {place}: {error}") from None
            if (
                not math.isfinite(time)
                or time < (points[-1][0] if points else 0.0)
                or (points and time == points[-1][0])
            ):
                raise ValueError(f"point {place} is at {time:g} s; give times from 0 on that increase")
            try:
                points.append((time, 0.0 if zero else float(self._one(point[1]))))
            except ValueError as error:
                raise ValueError(f"point {place}: {error}") from None
        if len(points) < 2 or not any(number for _, number in points):
            raise ValueError("a curve needs two points at least, and one that is not zero")
        return tuple(points)

    def _one(self, value: Any) -> Any:
        return _read(self, value) if type(value) is str else self._checked(value)

    def _checked(self, value: Any) -> Any:
        """Return one value in SI if it is within the limits."""
        number: Any = value if type(value) is float and not math.isnan(value) else in_si(value, self.dimension)
        if self.unit == "1" and isinstance(value, Real):
            # a whole number stays one
            number = value
        shown = self.shown or self.unit
        factor = SHOWN.get(shown, 1.0)
        if self._allows(number, factor):
            return number
        if shown == "1":
            raise OutOfRange(self._range, f"{number:.6g}; {self._range}")
        said, note = f"{number / factor:.6g} {shown}", ""
        if isinstance(value, Real) and not self._sign:
            hint = f"; write '{value} {shown}' if that is meant" if self._allows(float(value) * factor, factor) else ""
            note = f" (a plain number is in {self.unit}{hint if shown != self.unit else ''})"
        as_given = f"{value} {shown}" if isinstance(value, Real) and factor == 1.0 else said
        raise OutOfRange(f"this is {said}; {self._range}{note}", f"{as_given}; {self._range}{note}")

    def _allows(self, number: float, factor: float) -> bool:
        # a limit that is not given is no number, of which no comparison holds
        low, high, above, below = (
            math.nan if limit is None else limit * factor for limit in (self.low, self.high, self.above, self.below)
        )
        beyond = number < low - ROUNDING * abs(low) or number > high + ROUNDING * abs(high)
        return not (beyond or number <= above or number >= below)

    @property
    def _sign(self) -> bool:
        """Whether the only limit is zero, of which every unit is the same."""
        return 0.0 in (self.low, self.above) and self.high is None and self.below is None

    @property
    def _range(self) -> str:
        """What a message asks for."""
        if self.remedy:
            return self.remedy
        if self._sign and not self.whole:
            return "it must be positive" if self.low is None else "it must not be negative"
        low, high, above, below = (_number(v) for v in (self.low, self.high, self.above, self.below))
        bounds = [f"{low} or more" if low else "", f"more than {above}" if above else ""]
        bounds += [f"up to {high}" if high else "", f"less than {below}" if below else ""]
        span = f"{low} to {high}" if low and high else " and ".join(filter(None, bounds))
        unit = self.shown or self.unit
        kind = "a whole number, " if self.whole else "" if span else "a number"
        return f"give {kind}{span}{'' if unit == '1' else f' {unit}'}"


@lru_cache(maxsize=1024)
def _read(measure: Measure, text: str) -> Any:
    """Return what a text is in SI: the same texts are read again for each change of a description."""
    return measure._checked(text)


def two(value: Sequence) -> tuple:
    """Return the values of driver and driven."""
    if len(value) != 2:
        raise ValueError(f"{len(value)} values; give one for both wheels, or those of driver and driven")
    return tuple(value)


def in_si(value: Any, dimension: str) -> float:
    """Return a quantity in SI.

    Raises
    ------
    NoQuantity
        For what `gearmbs.units.to_si` cannot read.
    """
    try:
        return to_si(value, dimension, "value")
    except (TypeError, ValueError) as error:
        raise NoQuantity(str(error).removeprefix("value: ")) from None


LEAST_ACCURATE = 0.5
"""Largest accuracy that can be asked for: beyond it a number is not known at all."""


def accuracy_part(accuracy: Any, of: str, smallest: float) -> float:
    """Return an accuracy that is asked for as a part, from a number or a text such as "1 %".

    Parameters
    ----------
    accuracy : float or str
    of : str
        What it is a part of, for the message.
    smallest : float

    Raises
    ------
    ValueError
        If it is none, or beyond what can be asked for.
    """
    try:
        wanted = float(to_si(accuracy, "dimensionless", "accuracy"))
    except (TypeError, ValueError):
        wanted = 0.0
    if not smallest <= wanted <= LEAST_ACCURATE:
        raise ValueError(
            f"accuracy = {accuracy!r}: is a part of {of}; give {smallest:g} to {LEAST_ACCURATE:g}, such as 0.01 or "
            '"1 %"'
        )
    return wanted


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:g}"


def counts(hint: Any) -> bool:
    """Whether an annotation allows numbers and no truth values, which Python takes for 1 and 0."""
    if hint in (int, float):
        return True
    inner = get_args(hint)
    return bool not in inner and any(map(counts, inner))


def no_truth(value: Any) -> Any:
    """Return a value unless it is true or false, or a list that holds one."""
    if isinstance(value, bool):
        raise ValueError("give a number, not true or false")
    if isinstance(value, (list, tuple)):
        for item in value:
            no_truth(item)
    return value


def flag(value: Any) -> Any:
    """Return true, false or None; pydantic takes texts and numbers for truth values as well."""
    try:
        return None if value is None else truth(value)
    except ValueError:
        raise ValueError("give true or false") from None


@dataclass(frozen=True)
class OverTime:
    """A value over time: a number, a text with a unit or an expression, or an object that gives one.

    Attributes
    ----------
    dimension : str
        As of `Measure`; default: any.
    """

    dimension: str = ""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        from pydantic_core import core_schema

        return core_schema.no_info_plain_validator_function(self.read)

    def read(self, value: Any) -> Any:
        """Return the value, a number if it is finite; a text that is a number alone has no unit."""
        if getattr(value, "shape", None) == () and not hasattr(value, "units"):
            # an array of one number
            value = value.item()
        asked = "give a finite number, a quantity with its unit or an expression of time"
        if isinstance(value, bool) or (isinstance(value, Real) and not math.isfinite(value)):
            raise OutOfRange(asked, f"{value}; {asked}")
        if not (isinstance(value, Real | str) or is_dataclass(value) or hasattr(value, "magnitude")):
            # a function of time is a dataclass, a quantity of pint has a magnitude; lists, tables and dates are neither
            raise OutOfRange(asked, f"{value!r}; {asked}")
        if isinstance(value, str):
            try:
                float(value)
            except ValueError:
                if self.dimension and si_unit(value) is not None:
                    in_si(value, self.dimension)
                return value
            raise OutOfRange(asked, f"{value!r}; {asked}")
        return value


@dataclass(frozen=True)
class OneOf:
    """One of some names, which are looked at when a value is read: a table may have got a row."""

    names: Collection[Any]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        from pydantic_core import core_schema

        return core_schema.no_info_before_validator_function(self.read, handler(source))

    def read(self, value: Any) -> Any:
        """Return the name."""
        if value not in self.names:
            raise ValueError(f"choose {any_of(map(str, self.names))}")
        return value

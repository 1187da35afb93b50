"""Makes and changes the objects of a model as commands say: names, places, variables, settings."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from gearmbs.adams.view import frames, machinery, tires
from gearmbs.adams.view.expressions import text_of
from gearmbs.adams.view.lexer import Command, ViewError
from gearmbs.adams.view.model import (
    BLOCKS,
    DIRECTIONS,
    GENERAL_MOTION,
    JOINTS,
    PARTS,
    PLACED,
    Database,
    Item,
)
from gearmbs.adams.view.renaming import rename
from gearmbs.adams.view.simulations.activity import needed
from gearmbs.adams.view.values import ORIENTATIONS, Stored, Values, fixed, is_ground
from gearmbs.adams.view.vocabulary import Row, argument_of

REFERRING = ("marker", "marker_name", "part_name")
"""Endings of arguments that name markers and parts."""
GIVEN_MASS = ("mass", "inertia_marker", "ixx", "iyy", "izz", "ixy", "izx", "iyz")
"""What a part has by its geometry instead, when a command gives it a material or a density only."""
ON, OFF = ("on", "yes", "true", "1"), ("off", "no", "false", "0")
NUMBERLESS = {"adams_id", "ground_part", "material_type", "planar"}
"""Arguments of parts that hold no numbers with units."""
ALTERNATIVES = (
    (("function",), ("user_function", "routine")),
    (("end_time",), ("duration",)),
    (("number_of_steps",), ("step_size",)),
)
"""Arguments that say the same in two ways: an object has those that it was given last."""
LIMITS = ("range", "allowed_values", "delta_type", "use_range", "use_allowed_values")
"""What a variable has for studies of designs."""
VALUES = ("real_value", "integer_value", "string_value", "object_value")


class Editor:
    """Carries out what commands say of objects.

    Parameters
    ----------
    variables : mapping of str to float
        Values of variables instead of those that commands give.

    Attributes
    ----------
    database : Database
    values : Values
    overrides : dict of str to float
    overridden : dict of str to set of str
        Those of them that there are variables for, with the full names of these.
    nominal : dict of str to float
        What the file itself gives these, by full names.
    """

    def __init__(self, variables: Mapping[str, float] | None = None) -> None:
        self.database = Database()
        self.values = Values(self.database)
        self.overrides = {name.lower(): float(value) for name, value in (variables or {}).items()}
        self.overridden: dict[str, set[str]] = {}
        self.nominal: dict[str, float] = {}

    def _arguments(self, command: Command, row: Row) -> dict[str, Stored]:
        """Return the arguments of a command by their full names."""
        given: dict[str, Stored] = {}
        for word, values in command.arguments:
            name = argument_of(row, word, values[0].line if values else command.line)
            if name in given:
                raise ViewError(f"{' '.join(row.words)}: {name} is given twice", command.line)
            if row.arguments.get(name, False):
                given[name] = self.values.stored(values)
        return given

    def _now(self, stored: Stored) -> list[Any]:
        """Return what an argument comes to at once; words that name nothing stay words."""
        found: list[Any] = []
        for kind, value in stored.values:
            one = self.values.evaluate(value, stored.line) if kind == "tree" else value
            found.extend(one if isinstance(one, list) else [one])
        return found

    def _name(self, row: Row, given: dict[str, Stored], line: int) -> str | None:
        if row.naming not in given:
            return None
        found = self._now(given[row.naming])
        if len(found) != 1:
            raise ViewError(f"{' '.join(row.words)}: {row.naming} is one name", line)
        return text_of(found[0])

    def _named(self, row: Row, given: dict[str, Stored], line: int) -> list[Item]:
        """Return the objects that a command is about."""
        if row.naming not in given:
            raise ViewError(f"{' '.join(row.words)} needs {row.naming}", line)
        found = []
        for one in self._now(given[row.naming]):
            item = one if isinstance(one, Item) else self.database.find(text_of(one))
            if item is None:
                raise ViewError(f"{' '.join(row.words)}: there is no {text_of(one)[:80]}", line)
            found.append(item)
        return found

    def _attributes(self, row: Row, given: dict[str, Stored], line: int) -> None:
        """Switch objects on or off."""
        active = self._switched(row, given, "active", line)
        others = [key for key in ("dependents_active", "member_dependents_active") if key in given]
        found = self._members_of(row, given, line) if active is not None or others else []
        for key in others:
            self._check_dependents(row, key, self._switched(row, given, key, line), active, found, line)
        self.database.version += 1
        for item in found if active is not None else []:
            item.active, item.told = bool(active), self.database.version
            item.fields.pop("expr_active", None)

    def _switched(self, row: Row, given: dict[str, Stored], key: str, line: int) -> bool | None:
        """Return whether an argument switches on or off, None if it leaves all as it is."""
        word = text_of((self._now(given[key]) or [""])[0]).lower() if key in given else "no_opinion"
        if word not in (*ON, *OFF, "no_opinion", "no_op"):
            raise ViewError(f"{' '.join(row.words)}: {key} = {word[:40]}; give on, off or no_opinion", line)
        return None if word.startswith("no_op") else word in ON

    def _members_of(self, row: Row, given: dict[str, Stored], line: int) -> list[Item]:
        """Return the objects that attributes are given."""
        found = []
        for one in self._now(given[row.naming]) if row.naming in given else []:
            item = one if isinstance(one, Item) else self.database.find(text_of(one))
            if item is not None:
                found.append(item)
            elif row.words[0] != "geometry":
                raise ViewError(f"{' '.join(row.words)}: there is no {text_of(one)[:80]}", line)
        return found

    def _check_dependents(
        self, row: Row, key: str, wanted: bool | None, active: bool | None, found: list[Item], line: int
    ) -> None:
        """See that what needs an object is switched as asked for: what needs something that is off, is off here, too.

        Raises
        ------
        ViewError
            If that is not what is asked for.
        """
        if wanted is None or (wanted is False and active is False):
            return
        command = " ".join(row.words)
        if wanted is not active:
            raise ViewError(f"{command}: {key} without active as well; name what is to be switched", line)
        for other in self.database:
            if not other.active and any(one in found for several in needed(self.values, other) for one in several):
                raise ViewError(f"{command}: {key} = on: {other.path} is off itself; switch it on by its name", line)

    def _object(self, row: Row, given: dict[str, Stored], line: int) -> None:
        """Make or change an object."""
        name = self._name(row, given, line)
        item = self._of_name(row, name, line)
        fields = {key: self._meant_now(key, value) for key, value in given.items() if key != row.naming}
        self._take_back(row, item, fields, line)
        new = fields.pop(f"new_{row.naming}", None)
        if new is not None:
            rename(self.database, item, text_of((self._now(new) or [""])[0]), line)
        if "ground_part" in fields:
            self._ground(item, fields, line)
        if fields.keys() & {"density", "material_type"} and "mass" not in fields:
            # the last command decides: from now on the mass is that of the geometry
            for key in GIVEN_MASS:
                item.fields.pop(key, None)
        for one, other in (*ALTERNATIVES, *((b, a) for a, b in ALTERNATIVES)):
            if set(one) & fields.keys() and not set(other) & fields.keys():
                for key in other:
                    item.fields.pop(key, None)
        placed = {key: one for key, one in fields.items() if key in ("location", "orientation", "relative_to")}
        if item.kind in PLACED and item.kind != "model":
            self._place(item, fields)
        else:
            self._note_frame(item, fields)
        item.fields.update(fields)
        if item.kind == "csg":
            # what a solid is made of belongs to it from now on
            for part in [*self.values.refs(item, "base_object"), *self.values.refs(item, "object")]:
                self.database.move(part, f"{item.path}.{part.name}", line)
        if item.kind in PARTS:
            self.database.part = item
        if item.kind == "ude" and row.verb == "create":
            self._parts_of_instance(item, line)
        if item.kind == "ude" and (wheel := self.database.items.get(f"{item.path}.wheel_part".lower())) is not None:
            self._place(wheel, placed)
            wheel.fields.update(placed)
        if row.kind == "model":
            self._new_model(item, line)
        self.database.version += 1
        if "expr_active" in fields:
            item.active, item.told = True, self.database.version

    def _take_back(self, row: Row, item: Item, fields: dict[str, Stored], line: int) -> None:
        """Take what ``no_X = yes`` says out of an object: it has no X from then on, as if none had been given."""
        for key in [one for one in fields if one.startswith("no_") and one[3:] in row.arguments]:
            word = text_of((self._now(fields.pop(key)) or [""])[0]).lower()
            if word not in ON:
                continue
            if key[3:] in fields:
                raise ViewError(f"{' '.join(row.words)}: {key[3:]} and {key} exclude each other; give one", line)
            item.fields.pop(key[3:], None)

    def _meant_now(self, key: str, stored: Stored) -> Stored:
        """Return what names markers or parts with their full names: short ones mean those of the current part."""
        if not key.endswith(REFERRING) or all(kind != "word" for kind, _ in stored.values):
            return stored
        found = []
        for kind, value in stored.values:
            one = self.database.find(value, PLACED) if kind == "word" and not value.startswith(".") else None
            found.append((kind, value if one is None else one.path))
        return replace(stored, values=tuple(found))

    def _parts_of_instance(self, item: Item, line: int) -> None:
        """Make what commands may go on to name: states of a block of Controls, part of a wheel, motions."""
        kind = self.values.definition(item)
        if kind == machinery.ELEMENT:
            machinery.add_wheel(self.database, item, line)
        if kind == tires.TIRE:
            tires.add_wheel(self.database, item, line)
        for direction in DIRECTIONS if kind == GENERAL_MOTION else ():
            self.database.add("motion_of_instance", f"{item.path}.motion_{direction}", line)
        for ending in BLOCKS.get(kind, ()):
            self.database.add("state_variable", f"{item.path}.{item.name}{ending}", line)
        if kind.endswith("pid"):
            self.database.add("diff", f"{item.path}.{item.name}_sys", line)

    def _of_name(self, row: Row, name: str | None, line: int) -> Item:
        """Return the object of a command, made if it is to be made."""
        db = self.database
        if name is None and row.verb != "create" and (last := db.of(row.kind)):
            return last[-1]
        if name is None:
            if row.verb != "create" or row.kind not in ("marker", "part", "point"):
                raise ViewError(f"{' '.join(row.words)} needs {row.naming}", line)
            stem = f"{row.kind.upper()}_"
            k = 1
            while db.find(db.full_name(f"{stem}{k}", row.kind, line)) is not None:
                k += 1
            name = f"{stem}{k}"
        known = db.find(name) if row.verb != "create" or name.startswith(".") else None
        if known is None and row.verb == "create":
            known = db.items.get(db.full_name(name, row.kind, line).lower())
        if row.kind in ("integrator", "gstiff", "wstiff"):
            owner = self._model_named(name, line)
            known = db.items.get(f"{owner.path}.{row.kind}".lower())
            return known or db.add(row.kind, f"{owner.path}.{row.kind}", line)
        if row.verb == "create" and known is None:
            path = db.full_name(name, row.kind, line)
            self._check_owner(path, row.kind, line)
            return db.add(row.kind, path, line)
        if known is None:
            raise ViewError(f"{' '.join(row.words)}: there is no {name[:80]}", line)
        again = row.words[-1] in ("mass_properties", "initial_velocity", "modal_ics") or is_ground(known)
        if known.kind != row.kind and not (row.kind in JOINTS and known.kind in JOINTS):
            raise ViewError(f"{' '.join(row.words)}: {known.path} is a {known.kind.replace('_', ' ')}", line)
        if row.verb == "create" and not again:
            raise ViewError(f"{' '.join(row.words)}: there is a {known.path} already, made in line {known.line}", line)
        return known

    def _model_named(self, name: str, line: int) -> Item:
        found = self.database.find(name if name.startswith(".") else "." + name)
        if found is None or found.kind != "model":
            raise ViewError(f"there is no model {name[:60]}", line)
        return found

    def _check_owner(self, path: str, kind: str, line: int) -> None:
        """See that what a new object belongs to exists.

        Raises
        ------
        ViewError
        """
        if kind == "model" or path.count(".") < 2:
            if kind in PLACED and kind != "model":
                raise ViewError(f"{path} belongs to no model", line)
            return
        owner = self.database.items.get(path.rsplit(".", 1)[0].lower())
        if owner is None:
            raise ViewError(f"{path}: there is no {path.rsplit('.', 1)[0]}", line)
        if kind in ("marker", "point") and owner.kind not in (*PARTS, "fe_part"):
            raise ViewError(f"{path}: a {kind} belongs to a part; {owner.path} is a {owner.kind}", line)

    def _ground(self, item: Item, fields: dict[str, Stored], line: int) -> None:
        """See to it that a model has one ground."""
        word = text_of((self._now(fields["ground_part"]) or [""])[0]).lower()
        if word not in ON:
            del fields["ground_part"]
            return
        for other in self.database.of("part"):
            if other is not item and is_ground(other) and other.parent == item.parent:
                if other.children:
                    raise ViewError(f"{other.path} is the ground already", line)
                self.database.remove(other)

    def _new_model(self, item: Item, line: int) -> None:
        db = self.database
        db.model = item
        if item.path.count(".") > 1:
            # a model within another has the other's ground
            return
        ground = db.items.get(f"{item.path}.ground".lower())
        if ground is None:
            ground = db.add("part", f"{item.path}.ground", line)
            ground.fields["ground_part"] = fixed("yes", line=line)
        db.part, db.frame = ground, None

    def _place(self, item: Item, fields: dict[str, Stored]) -> None:
        """Bring places into the frame of an object's home, or keep their expressions with their frame."""
        values = self.values
        frame = self.database.frame
        if "relative_to" in fields:
            stored = fields.pop("relative_to")
            holder = Item("", item.path, stored.line, {"relative_to": stored})
            frame = values.ref(holder, "relative_to", PLACED)
        home = values.home(item)
        sequence = self.database.sequence
        if "location" in fields:
            stored = fields["location"]
            if stored.live:
                fields["location"] = Stored(stored.values, stored.line, frame)
            else:
                given = self._triple(stored, f"the location of {item.path}")
                point = frames.COORDINATES[self.database.coordinates](given, self.database.units.radian)
                here = values.brought(point, frame, home)
                fields["location"] = fixed(*(float(x) for x in here), line=stored.line)
        for key in ORIENTATIONS:
            if key not in fields:
                continue
            stored = fields.pop(key)
            if key != "orientation":
                fields["orientation"] = self._directed(item, key, stored, frame, fields)
            elif stored.live:
                fields[key] = Stored(stored.values, stored.line, frame, sequence)
            else:
                radian = self.database.units.radian
                angles = self._triple(stored, f"the orientation of {item.path}")
                a = frames.rotation([x * radian for x in angles], sequence, stored.line)
                if frame is not home and not values.same(frame, home):
                    a = values.pose(home)[0].T @ values.pose(frame)[0] @ a
                fields[key] = Stored((("value", a),), stored.line)

    def _note_frame(self, item: Item, fields: dict[str, Stored]) -> None:
        """Keep with the places of what has no frame itself how they are meant: by the defaults of the moment."""
        for key in ("location", *ORIENTATIONS):
            if key not in fields:
                continue
            meant = self.database.axis if key.endswith("_orientation") else self.database.sequence
            stored = replace(fields[key], frame=self.database.frame, sequence=meant)
            if key == "location" and self.database.coordinates != "car" and not stored.live:
                given = self._triple(stored, f"the location of {item.path}")
                point = frames.COORDINATES[self.database.coordinates](given, self.database.units.radian)
                stored = replace(stored, values=fixed(*(float(x) for x in point)).values)
            fields[key] = stored

    def _triple(self, stored: Stored, what: str) -> list[float]:
        found = self._now(stored)
        if len(found) != 3 or not all(isinstance(x, (int, float)) for x in found):
            shown = ", ".join(text_of(x) for x in found)[:60]
            raise ViewError(f"{what} is three numbers, not {shown}", stored.line)
        return [float(x) for x in found]

    def _directed(self, item: Item, key: str, stored: Stored, frame: Item | None, fields: dict[str, Stored]) -> Stored:
        """Return the orientation that points give: an axis through two, and a plane through a third."""
        values = self.values
        found = self._now(stored)
        if not all(isinstance(x, (int, float)) for x in found) or len(found) not in (3, 6, 9):
            raise ViewError(f"{key} of {item.path}: these are no points of three coordinates", stored.line)
        home = values.home(item)
        points = [values.brought(np.array(found[k : k + 3], float), frame, None) for k in range(0, len(found), 3)]
        if len(points) < (2 if key == "along_axis_orientation" else 3):
            start = fields.get("location", item.fields.get("location"))
            at = np.array(self._triple(start, "location")) if start is not None else frames.ORIGIN
            points.insert(0, values.brought(at, home, None))
        a = values.pose(home)[0].T @ frames.directed(key, points, self.database.axis)
        return Stored((("value", a),), stored.line)

    # Variables, settings, files and macros.

    def _variable(self, row: Row, given: dict[str, Stored], line: int) -> None:
        db = self.database
        name = self._name(row, given, line)
        if name is None:
            raise ViewError(f"{' '.join(row.words)} needs variable_name", line)
        loop = self.values.loops.get(name.lower())
        item = loop or db.find(name, ("variable",))
        if (
            item is None
            and row.verb == "modify"
            and (owner := db.items.get(name.rpartition(".")[0].lower())) is not None
        ):
            if owner.kind != "ude":
                raise ViewError(f"variable modify: there is no variable {name[:80]}", line)
            item = db.add("variable", name, line)
        if item is None and row.verb == "modify":
            raise ViewError(f"variable modify: there is no variable {name[:80]}", line)
        if item is not None and row.verb == "create":
            raise ViewError(f"variable create: there is a {item.path} already, made in line {item.line}", line)
        if item is None:
            item = db.add("variable", db.full_name(name, "variable", line), line)
        held = {key: given[key] for key in VALUES if key in given}
        if len(held) > 1:
            raise ViewError(f"{' '.join(row.words)}: give one of {', '.join(held)}", line)
        override = next((key for key in self.overrides if _meant(item, key)), None)
        if override is not None and loop is None:
            self.overridden.setdefault(override, set()).add(item.path)
            now = [one for stored in held.values() for one in self._now(stored)]
            if len(now) > 1 or any(isinstance(one, (str, Item)) for one in now):
                what = f"{len(now)} values" if len(now) > 1 else text_of(now[0])[:40]
                raise ViewError(f"variables: {item.path} holds {what}; a number takes the place of one number", line)
            if now:
                self.nominal[item.path] = float(now[0])
            item.fields["real_value"] = fixed(self.overrides[override], line=line)
        elif held and "index" in given:
            self._member(item, given["index"], next(iter(held.items())), line)
        elif held:
            for key in VALUES:
                item.fields.pop(key, None)
            item.fields.update(held)
        item.fields.update((key, given[key]) for key in ("units", *LIMITS) if key in given)
        db.version += 1

    def _member(self, item: Item, index: Stored, held: tuple[str, Stored], line: int) -> None:
        """Set one member of a variable that is a list."""
        k = round(self._number(index, line))
        old = self.values.variable(item)
        members = list(old) if isinstance(old, list) else [old]
        if not 1 <= k <= len(members) + 1000:
            raise ViewError(f"index = {k}: {item.path} has {len(members)} members", line)
        members += [0] * (k - len(members))
        members[k - 1] = self._now(held[1])[0]
        item.fields[held[0]] = fixed(*members, line=line)

    def _defaults(self, row: Row, given: dict[str, Stored], line: int) -> None:
        db = self.database
        db.version += 1
        what = row.words[1]
        words = {key: text_of((self._now(value) or [""])[0]) for key, value in given.items()}
        if what == "units":
            for quantity in ("force", "mass", "length", "time", "angle"):
                if quantity in words:
                    before = db.units.names[quantity]
                    db.units.choose(quantity, words[quantity], line)
                    if db.units.names[quantity] != before and (quantity in db.units.converted or self._has_numbers()):
                        raise ViewError(
                            f"the unit of {quantity} is changed after numbers were given in it; choose it before", line
                        )
            if "coordinate_system_type" in words:
                given_type = words["coordinate_system_type"][:30].lower()
                if given_type[:3] not in frames.COORDINATES:
                    raise ViewError(f"coordinate_system_type = {given_type}; cartesian, cylindrical, spherical", line)
                db.coordinates = given_type[:3]
            if "orientation_type" in words:
                frames.rotation([0.0, 0.0, 0.0], words["orientation_type"], line)
                db.sequence = words["orientation_type"]
        elif what == "coordinate_system" and "default_coordinate_system" in given:
            holder = Item("", "defaults", line, dict(given))
            db.frame = self.values.ref(holder, "default_coordinate_system", PLACED)
        elif what == "orient_axis_and_plane" and "axis_and_plane_setting" in words:
            setting = words["axis_and_plane_setting"].lower()
            if not re.match(r"[xyz]_axis(_(xy|yx|yz|zy|xz|zx)_plane)?\Z", setting):
                raise ViewError(f"axis_and_plane_setting = {setting[:40]}; give z_axis_zx_plane or the like", line)
            db.axis = setting if setting.endswith("plane") else f"{setting}_xz_plane"
        elif what == "model":
            if "model_name" in words:
                db.model = self._model_named(words["model_name"], line)
            if "part_name" in words:
                part = db.find(words["part_name"], PARTS)
                if part is not None:
                    db.part = part

    def _has_numbers(self) -> bool:
        """Return whether anything holds numbers in the units of the moment: of variables those that have a unit."""
        for item in self.database:
            if item.kind == "variable" and self.values.word(item, "units", "no_units") not in ("no_units", ""):
                return True
            if item.kind not in ("model", "variable", "part") or (
                item.kind == "part" and set(item.fields) - NUMBERLESS
            ):
                return True
        return False

    def _number(self, stored: Stored, line: int) -> float:
        found = self._now(stored)
        value = found[0] if found else None
        if isinstance(value, Item) and value.kind == "variable":
            value = self.values.variable(value)
        if not isinstance(value, (int, float)):
            raise ViewError(f"a number is wanted, not {text_of(value)[:60] if value is not None else 'nothing'}", line)
        return value

    # One command.


def _meant(item: Item, key: str) -> bool:
    path = item.path.lower()
    return path == key or (not key.startswith(".") and path.endswith("." + key))

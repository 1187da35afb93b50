"""From the objects of a model to the statements of a deck: data, equations, sensors, requests and settings."""

from __future__ import annotations

from collections.abc import Callable

from gearmbs.adams.view.deckmaker import Deckmaker
from gearmbs.adams.view.lexer import ViewError
from gearmbs.adams.view.model import Item
from gearmbs.adams.view.statements import refuse
from gearmbs.adams.write.text import listed, number

ARRAYS = ("array", "ic_array", "x_array", "u_array", "y_array")
MATRICES = ("matrix", "sparse_matrix")


def make_variable(m: Deckmaker, item: Item) -> None:
    """VARIABLE."""
    m.add(item, f"VARIABLE/{m.id(item)}", *(m.user(item) or [m.expression(item, "function", "FUNCTION", "0")]))


def make_diff(m: Deckmaker, item: Item) -> None:
    """DIFF."""
    m.add(
        item,
        f"DIFF/{m.id(item)}",
        m.reals(item, "initial_condition", "IC"),
        "IMPLICIT" if m.yes(item, "implicit") else None,
        "STATIC_HOLD" if m.yes(item, "static_hold") else None,
        *(m.user(item) or [m.expression(item, "function", "FUNCTION", "0")]),
    )


def make_array(m: Deckmaker, item: Item) -> None:
    """ARRAY of numbers, states, inputs or outputs."""
    head = f"ARRAY/{m.id(item)}"
    size = m.values.number(item, "size")
    sized = None if size is None else f"SIZE = {int(size)}"
    if item.kind == "u_array":
        m.add(item, head, "U", sized, m.refs(item, "variable_name", "VARIABLES", ("state_variable",)))
    elif item.kind in ("x_array", "y_array"):
        m.add(item, head, item.kind[0].upper(), sized)
    else:
        numbers = m.values.numbers(item, "numbers") or []
        m.add(item, head, "IC", f"SIZE = {len(numbers)}", f"NUMBERS = {listed(numbers)}" if numbers else None)


def make_matrix(m: Deckmaker, item: Item) -> None:
    """MATRIX; one of few numbers is written out."""
    values = m.values.numbers(item, "values") or []
    if item.kind == "matrix":
        rows, columns = (int(m.values.number(item, f"{key}_count") or 0) for key in ("row", "column"))
        order = "CORDER" if m.values.word(item, "input_order").endswith("column") else "RORDER"
    else:
        at = [[int(x) for x in m.values.numbers(item, f"{key}_index") or []] for key in ("row", "column")]
        if not values or not len(at[0]) == len(at[1]) == len(values) or min(*at[0], *at[1]) < 1:
            raise ViewError("row_index, column_index and values go together")
        rows, columns, order = max(at[0]), max(at[1]), "RORDER"
        if rows * columns > 1_000_000:
            raise ViewError(f"a matrix of {rows} rows and {columns} columns")
        full = [0.0] * (rows * columns)
        for i, j, x in zip(*at, values):
            full[(i - 1) * columns + j - 1] = x
        values = full
    sizes = (f"FULL = {order}", f"ROWS = {rows}", f"COLUMNS = {columns}")
    m.add(item, f"MATRIX/{m.id(item)}", *sizes, f"VALUES = {listed(values)}")


def make_curve(m: Deckmaker, item: Item) -> None:
    """CURVE."""
    item.used |= {"tension"}
    user = m.user(item)
    ends = "CLOSED" if m.yes(item, "closed") else "OPEN"
    if user is not None:
        limits = (m.real(item, "minimum_parameter", "MINPAR"), m.real(item, "maximum_parameter", "MAXPAR"))
        m.add(item, f"CURVE/{m.id(item)}", ends, *limits, *user)
        return
    item.used |= {"minimum_parameter", "maximum_parameter"}
    points = m.values.word(item, "fit_type", "curve_points").upper()
    order = m.values.number(item, "interpolation_order")
    m.add(
        item,
        f"CURVE/{m.id(item)}",
        ends,
        points,
        None if order is None else f"ORDER = {int(order)}",
        m.ref(item, "matrix_name", "MATRIX", MATRICES),
    )


def make_spline(m: Deckmaker, item: Item) -> None:
    """SPLINE of numbers."""
    x, y, z = (m.values.numbers(item, key) for key in "xyz")
    if x is None or y is None:
        raise ViewError("a spline from a file or from results is not read; give x and y")
    units = " ".join(m.values.word(item, key) for key in ("units", "x_units", "y_units", "z_units"))
    if "angle" in units and m.radian != 1.0:
        raise ViewError("the numbers of a spline in degrees: give them in radians, without units")
    head = f"SPLINE/{m.id(item)}"
    extra = "LINEAR_EXTRAPOLATE" if m.yes(item, "linear_extrapolate") else None
    if z is None:
        m.add(item, head, extra, f"X = {listed(x)}", f"Y = {listed(y)}")
        return
    if len(y) != len(x) * len(z):
        raise ViewError(f"{len(y)} values of y for {len(x)} of x and {len(z)} of z")
    rows = [y[k * len(x) : (k + 1) * len(x)] for k in range(len(z))]
    m.add(item, head, extra, f"X = {listed(x)}", *(f"Y = {listed([at, *row])}" for at, row in zip(z, rows)))


def make_string(m: Deckmaker, item: Item) -> None:
    """STRING."""
    m.add(item, f"STRING/{m.id(item)}", f"STRING = {m.values.text(item, 'string') or ''}")


def make_plant(m: Deckmaker, item: Item) -> None:
    """PINPUT or POUTPUT."""
    keyword = "PINPUT" if item.kind == "plant_input" else "POUTPUT"
    m.add(item, f"{keyword}/{m.id(item)}", m.refs(item, "variable_name", "VARIABLES", ("state_variable",)))


def _states(m: Deckmaker, item: Item) -> list[str | None]:
    names = (("x_state_array_name", "X"), ("u_input_array_name", "U"), ("y_output_array_name", "Y"))
    hold = "STATIC_HOLD" if m.yes(item, "static_hold") else None
    return [*(m.ref(item, key, keyword, ARRAYS) for key, keyword in names), hold]


def make_lse(m: Deckmaker, item: Item) -> None:
    """LSE."""
    names = (
        ("a_state_matrix_name", "A"), ("b_input_matrix_name", "B"), ("c_output_matrix_name", "C"),
        ("d_feedforward_matrix_name", "D"),
    )  # fmt: skip
    matrices = [m.ref(item, key, keyword, MATRICES) for key, keyword in names]
    m.add(item, f"LSE/{m.id(item)}", *_states(m, item), m.ref(item, "ic_array_name", "IC", ARRAYS), *matrices)


def make_tfsiso(m: Deckmaker, item: Item) -> None:
    """TFSISO."""
    item.used.add("ic_array_name")
    coefficients = (
        m.reals(item, "numerator_coefficients", "NUMERATOR"),
        m.reals(item, "denominator_coefficients", "DENOMINATOR"),
    )
    m.add(item, f"TFSISO/{m.id(item)}", *_states(m, item), *coefficients)


def make_gse(m: Deckmaker, item: Item) -> None:
    """GSE, whose equations are routines."""
    counts = (
        ("state_equation_count", "NS"), ("output_equation_count", "NO"), ("discrete_state_equation_count", "ND"),
    )  # fmt: skip
    numbers = [None if (n := m.values.number(item, key)) is None else f"{word} = {int(n)}" for key, word in counts]
    refs = (("discrete_state_array_name", "XD"), ("ic_array_name", "IC"), ("discrete_ic_array_name", "ICD"))
    item.used.add("discrete")
    interface = m.values.text(item, "interface_routines") if "interface_routines" in item.fields else None
    m.add(
        item,
        f"GSE/{m.id(item)}",
        *_states(m, item),
        *numbers,
        *(m.ref(item, key, word, ARRAYS) for key, word in refs),
        "IMPLICIT" if m.yes(item, "implicit") else None,
        m.expression(item, "sample_period", "SAMPLE_PERIOD"),
        m.real(item, "sample_offset", "SAMPLE_OFFSET"),
        *(m.user(item) or []),
        f"INTERFACE = {interface}" if interface else None,
    )


FLAGS = (
    ("halt", "HALT"), ("print", "PRINT"), ("restart", "RESTART"), ("return", "RETURN"), ("codgen", "CODGEN"),
    ("yydump", "YYDUMP"), ("bisection", "BISECTION"),
)  # fmt: skip


def make_sensor(m: Deckmaker, item: Item) -> None:
    """SENSOR."""
    item.used.add("time_error")
    turning = m.values.number(item, "angular_value")
    value = m.real(item, "value", "VALUE") if turning is None else f"VALUE = {number(turning * m.radian)}"
    error = m.real(item, "error", "ERROR") or m.real(item, "angular_error", "ERROR", m.radian)
    evaluate = m.user(item, "user_evaluate", "EVALUATE") or [m.expression(item, "evaluate", "EVALUATE")]
    m.add(
        item,
        f"SENSOR/{m.id(item)}",
        m.values.word(item, "compare", "eq").upper(),
        value,
        error,
        *(keyword for key, keyword in FLAGS if m.yes(item, key)),
        m.real(item, "dt", "DT"),
        m.real(item, "stepsize", "STEPSIZE"),
        *(m.user(item) or [m.expression(item, "function", "FUNCTION", "0")]),
        *evaluate,
    )


COLUMNS = (2, 3, 4, 6, 7, 8)
"""Functions of a request that are free: the first and the fifth are sizes of the three behind them."""


def make_request(m: Deckmaker, item: Item) -> None:
    """REQUEST."""
    item.used |= {"comment", "component_names", "component_labels", "results_name", "title", "motion_rframe"}
    user = m.user(item)
    kind = m.values.word(item, "output_type")
    if user is not None:
        m.add(item, f"REQUEST/{m.id(item)}", *user)
    elif kind:
        names = (("i_marker_name", "I"), ("j_marker_name", "J"), ("r_marker_name", "RM"))
        m.add(item, f"REQUEST/{m.id(item)}", kind.upper(), *(m.ref(item, key, word) for key, word in names))
    elif variables := m.values.refs(item, "variable_name"):
        if len(variables) > len(COLUMNS):
            raise ViewError(f"{len(variables)} variables; a request holds {len(COLUMNS)}, give the others another one")
        functions = [f"F{k} = VARVAL({m.id(one)})" for k, one in zip(COLUMNS, variables)]
        m.add(item, f"REQUEST/{m.id(item)}", *functions)
    else:
        functions = [found for k in range(1, 9) if (found := m.expression(item, f"f{k}", f"F{k}")) is not None]
        if functions:
            m.add(item, f"REQUEST/{m.id(item)}", *functions)


def make_integrator(m: Deckmaker, item: Item) -> None:
    """INTEGRATOR."""
    method = m.values.word(item, "integrator_type", item.kind if item.kind != "integrator" else "gstiff").upper()
    item.used |= set(item.fields)
    method = {"SI2_GSTIFF": "GSTIFF"}.get(method, method)
    order = m.values.number(item, "kmax_integrator_order")
    formulation = m.values.word(item, "formulation").upper()
    m.add(
        item,
        "INTEGRATOR/",
        method,
        formulation or None,
        m.real(item, "error_tolerance", "ERROR"),
        m.real(item, "hinit_time_step", "HINIT"),
        m.real(item, "hmax_time_step", "HMAX"),
        m.real(item, "hmin_time_step", "HMIN"),
        None if order is None else f"KMAX = {int(order)}",
    )


MAKERS: dict[str, Callable[[Deckmaker, Item], None]] = {
    "state_variable": make_variable,
    "diff": make_diff,
    **dict.fromkeys(ARRAYS, make_array),
    **dict.fromkeys(MATRICES, make_matrix),
    "file_matrix": refuse(
        "a matrix in a file is read in decks; write it into the command file, or into the deck of --to-deck"
    ),
    "curve": make_curve,
    "spline": make_spline,
    "string": make_string,
    "plant_input": make_plant,
    "plant_output": make_plant,
    "lse": make_lse,
    "tfsiso": make_tfsiso,
    "gse": make_gse,
    "sensor": make_sensor,
    "integrator": make_integrator,
    "gstiff": make_integrator,
    "wstiff": make_integrator,
}
REQUESTS: dict[str, Callable[[Deckmaker, Item], None]] = {"request": make_request}
"""What only results depend on: it is left out with a remark where it cannot be made."""

"""What tests ask of messages: names, values and a remedy, in any order; not their sentences."""

import ast
import re
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from functools import cache
from itertools import accumulate

FUNCTION_WORDS = set(
    "a an the is are was were be been not no nor of in to and or it its by with for at on as has have had that which "
    "than but if so from into there this these those do does did can cannot must may would will should one they them "
    "their what where when who".split()
)
"""Words that are no names even if a test uses them for something."""

VALUES = set("True False None nan inf mm kg Hz kHz rad deg ms MPa GPa rpm min".split())
"""Numbers and units that are written as words."""


HOLE, NOWHERE, BETWEEN = "\0", "\1", "\2"
"""What stands in texts for something that is formatted into them, in patterns for what no text says, and after a text
where many are searched as one."""


def says(*words: str) -> str:
    """Return a pattern of messages in which all words stand, in any order and each as a whole.

    Examples
    --------
    >>> pattern = says("torque", "-5", "give")
    >>> bool(re.search(pattern, "give a positive torque, not -5"))
    True
    >>> bool(re.search(pattern, "torque: -5.5; give a positive one"))
    False
    """
    return r"(?s)\A" + "".join(f"(?=.*{_whole(word)})" for word in words)


def _whole(word: str) -> str:
    """Return the pattern of a word that is no part of a longer one, nor of a number with more digits."""
    before = r"(?<![\w.])" if word[0].isdigit() else r"(?<!\w)" if word[0].isalpha() else ""
    after = r"(?!\w|\.\d)" if word[-1].isdigit() else r"(?!\w)" if word[-1].isalpha() else ""
    return before + re.escape(word) + after


def prose(tree: ast.Module) -> Iterator[tuple[ast.expr, list[str]]]:
    """Yield what each ``match=`` of a module asks for, and its words that are no names or values.

    A name has a quote, a capital inside, a digit, a dot or a line, or is written by the test itself as well: as a
    variable, an argument or in a text.
    """
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    asked = {function: list(_asked(function, tree)) for function in functions}
    patterns = {part for nodes in asked.values() for node in nodes for part in ast.walk(node)}
    for function, nodes in asked.items():
        known = _written(function, patterns) - FUNCTION_WORDS if nodes else set()
        for node in nodes:
            yield node, [word for word in words(text(node)) if word.lower() not in known]


def _written(function: ast.FunctionDef, patterns: set[ast.AST]) -> set[str]:
    """Return the words of the names and texts of a function, but its own name, its docstring and its patterns."""
    inside = {node for part in [*function.body, *function.decorator_list, function.args] for node in ast.walk(part)}
    if ast.get_docstring(function) is not None:
        inside -= set(ast.walk(function.body[0]))
    values = [value for node in inside - patterns for _, value in ast.iter_fields(node) if isinstance(value, str)]
    return {word.lower() for value in values for word in re.findall("[A-Za-z]+", value)}


def words(pattern: str) -> list[str]:
    """Return the words of a pattern without names by their looks, values and the syntax of patterns."""
    plain = re.sub(r"\\[sSdDwWbBn]|\(\?[a-z:=!<]+", " ", pattern)
    plain = re.sub(r"(?<!\w)'[^']*'|\"[^\"]*\"|`[^`]*`", " ", plain).replace("\\", "")
    found = []
    for token in re.findall(r"[\w./-]+", plain):
        if not re.search(r"[\d_]|[a-z][A-Z]|[A-Z]{2}|\w\.\w|^\.\w", token):
            found += [word for word in re.findall("[A-Za-z]{2,}", token) if word not in VALUES]
    return found


def text(node: ast.expr) -> str:
    """Return what a text, a formatted one or the arguments of a call write."""
    if isinstance(node, ast.Call):
        return " ".join(text(argument) for argument in node.args)
    parts = [part.value for part in ast.walk(node) if isinstance(part, ast.Constant) and isinstance(part.value, str)]
    return " ".join(parts)


def raisable(tree: ast.Module) -> set[str]:
    """Return the texts of three words or more of a module, but docstrings; what is formatted into them is a `HOLE`."""
    documents = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    found, left = set(), [tree]
    while left:
        node: ast.AST = left.pop()
        whole = None if id(node) in documents else _written_out(node)
        if whole is None:
            left += ast.iter_child_nodes(node)
            continue
        if len(whole.replace(HOLE, " x ").split()) >= 3:
            found.add(whole)
        left += [part.value for part in ast.walk(node) if isinstance(part, ast.FormattedValue)]
    return found


def _written_out(node: ast.AST) -> str | None:
    """Return what a text, a formatted one or a sum of such says, None of any other node."""
    if isinstance(node, ast.JoinedStr):
        return "".join(part.value if isinstance(part, ast.Constant) else HOLE for part in node.values)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        parts = _written_out(node.left), _written_out(node.right)
        return None if parts == (None, None) else "".join(HOLE if part is None else part for part in parts)
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else None


def fitting(node: ast.expr, texts: frozenset[str]) -> list[str]:
    """Return which of the texts that can be raised a test's pattern fits by what is written in both of them.

    Names and values that a test fills in are written in none.
    """
    parts = [(_written_out(part) or HOLE).replace(HOLE, NOWHERE) for part in getattr(node, "args", [node])]
    called = _name(node.func) if isinstance(node, ast.Call) else ""
    if called == "escape":
        return list(_holding(parts[0], texts))
    if called == "says":
        pattern, inside = says(*parts), parts
    else:
        # a letter that may be missing, or one of two words, need not be there
        pattern, inside = parts[0], [] if re.search(r"\w[?*{]|[|\[(\\]", parts[0]) else re.findall(r"\w+", parts[0])
    near = [text for text in _holding(max(inside, key=len, default=""), texts) if all(part in text for part in inside)]
    return [text for text in near if re.search(pattern, text)] if called in ("", "says") else []


def _holding(part: str, texts: frozenset[str]) -> Sequence[str]:
    """Return the texts that hold a part. All are searched in one go, for patterns are many."""
    if not part:
        return list(texts)
    whole, ends = _in_one(texts)
    found, place = [], whole.find(part)
    while place >= 0:
        k = bisect_right(ends, place)
        begin = ends[k - 1] if k else 0
        found.append(whole[begin : ends[k] - 1])
        place = whole.find(part, ends[k])
    return found


@cache
def _in_one(texts: frozenset[str]) -> tuple[str, list[int]]:
    """Return all texts one after another, and where each ends; what stands between them is in no text and no part."""
    return "".join(text + BETWEEN for text in texts), list(accumulate(len(text) + 1 for text in texts))


def _asked(function: ast.FunctionDef, tree: ast.Module) -> Iterator[ast.expr]:
    for node in ast.walk(function):
        if isinstance(node, ast.keyword) and node.arg == "match":
            yield from _values(node.value, function, tree)


def _values(node: ast.expr, function: ast.FunctionDef, tree: ast.Module) -> Iterator[ast.expr]:
    """Yield what an expression stands for: itself, or what assignments, loops and marks give a name."""
    if not isinstance(node, ast.Name):
        yield node
        return
    for part in [*ast.walk(function), *function.decorator_list]:
        if isinstance(part, ast.Assign):
            yield from _given(node.id, part.targets[0], part.value)
        elif isinstance(part, ast.For | ast.comprehension):
            for row in _rows(part.iter, function, tree):
                yield from _given(node.id, part.target, row)
        elif isinstance(part, ast.Call) and _name(part.func) == "parametrize":
            for row in _rows(part.args[1], function, tree):
                yield from _given(node.id, part.args[0], row)


def _given(name: str, target: ast.expr, value: ast.expr) -> Iterator[ast.expr]:
    """Yield what a target, of names or of their texts, gives a name."""
    if _name(target) == name and not isinstance(value, ast.Name):
        # of a table without .items(), its key
        yield value.elts[0] if isinstance(value, ast.Tuple) else value
    inside = value.args if isinstance(value, ast.Call) and _name(value.func) == "param" else getattr(value, "elts", [])
    for part, cell in zip(getattr(target, "elts", []), inside):
        yield from _given(name, part, cell)


def _rows(node: ast.expr, function: ast.FunctionDef, tree: ast.Module) -> list[ast.expr]:
    """Return what a loop goes over, of a list, a table or the name of one."""
    if isinstance(node, ast.Name):
        scopes = [*ast.walk(function), *tree.body]
        values = [n.value for n in scopes if isinstance(n, ast.Assign) and _name(n.targets[0]) == node.id]
        return _rows(values[0], function, tree) if values else []
    if isinstance(node, ast.Call) and _name(node.func) == "items":
        return _rows(node.func.value, function, tree)
    if isinstance(node, ast.Dict):
        return [ast.Tuple([key, value]) for key, value in zip(node.keys, node.values)]
    return getattr(node, "elts", [])


def _name(node: ast.expr) -> str:
    return getattr(node, "attr", getattr(node, "id", getattr(node, "value", "")))

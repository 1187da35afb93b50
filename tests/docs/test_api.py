"""Every name the package exports has a page and a description."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import sys

import pytest

import gearmbs
from tests.docs.support import DOCS


@pytest.fixture(scope="module")
def pages():
    """Return the script that writes the pages."""
    sys.path.insert(0, str(DOCS / "scripts"))
    yield importlib.import_module("api_pages")
    sys.path.remove(str(DOCS / "scripts"))


def packages():
    """Return the subpackages that say what they export."""
    found = [info.name for info in pkgutil.walk_packages(gearmbs.__path__, "gearmbs.") if info.ispkg]
    return [name for name in found if hasattr(importlib.import_module(name), "__all__")]


@pytest.mark.parametrize("package", packages())
def test_exported_names_have_a_page(pages, package):
    documented = set()
    for name in pages.PACKAGES:
        for full in pages.entries(name):
            module, _, attribute = full.rpartition(".")
            documented.add(id(getattr(importlib.import_module(module), attribute)))
    module = importlib.import_module(package)
    constants = {**pages.CONSTANTS.get(package, {}), **pages.DESCRIBED.get(package, {})}
    for name in module.__all__:
        value = getattr(module, name)
        if inspect.ismodule(value):
            assert value.__doc__, f"{package}.{name}"
        elif callable(value):
            assert (value.__doc__ or "").strip(), f"{package}.{name} has no description"
            assert id(value) in documented, f"{package}.{name} has no page"
        else:
            assert name in constants, f"{package}.{name} is listed nowhere"


def test_modules_do_not_hide_exported_functions():
    """A submodule of the same name takes the place of a function when it is imported later."""
    for package in packages():
        module = importlib.import_module(package)
        for name in module.__all__:
            if inspect.ismodule(getattr(module, name)):
                assert (package, name) == ("gearmbs.gears", "faults"), f"{package}.{name} is a module"


@pytest.mark.parametrize(
    "package", ["gearmbs.signals", "gearmbs.view", "gearmbs.studies", "gearmbs.gears", "gearmbs.mechanism"]
)
def test_public_methods_are_described(package):
    module = importlib.import_module(package)
    for name in module.__all__:
        value = getattr(module, name)
        if not inspect.isclass(value):
            continue
        for key, member in vars(value).items():
            if not key.startswith("_") and (inspect.isfunction(member) or isinstance(member, property)):
                assert inspect.getdoc(getattr(value, key)), f"{package}.{name}.{key} has no description"

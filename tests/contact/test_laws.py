"""STEP and IMPACT, eq. (10) and (11), are the same in contacts, functions of time and the function language."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import gearmbs
from gearmbs.adams.write.contacts import normal_law_of
from gearmbs.adams.write.gear_expressions import REFUSED
from gearmbs.contact import law_kinds
from gearmbs.contact.law_kinds import LAW_IMPACT, LAW_KINDS
from gearmbs.contact.laws import damping_of_share, friction_law, normal_law
from gearmbs.contact.layout import FRICTION_ADAMS
from gearmbs.dae.equations.loads.time_functions import smooth_step
from gearmbs.drivetrain.parts import contact_law
from gearmbs.gears import ContactLaw, ContactModel, GearPair
from gearmbs.mechanism import Mechanism, ModelError, step
from tests.says import says

PACKAGE = Path(gearmbs.__file__).parent
STATE = 20e-6, 0.01
"""Penetration, m, and its rate, m/s."""


@pytest.fixture(params=LAW_KINDS)
def law(request):
    """Return a law of each kind that damps by 20 % at `STATE`."""
    _, _, slope, _, elastic = normal_law(LAW_KINDS[request.param].code, 3e9, 1.3, 1.0, 30e-6, STATE[0], 0.0)
    return ContactLaw(request.param, 3e9, 1.3, 0.2 * elastic / (slope * STATE[1]), 30e-6)


@pytest.fixture(scope="module")
def evaluate():
    """Return what evaluates an expression of TIME on the times of a body that flies."""
    m = Mechanism("flight")
    m.body("b", 1.0, (1, 1, 1), velocity=(1.0, 0, 0)).marker(name="m")
    solution = m.simulate(2.0, rate=200)
    return lambda text: (solution.t, solution.evaluate(text))


def cubic(x: float) -> float:
    """Eq. (11)."""
    x = min(max(x, 0.0), 1.0)
    return (3.0 - 2.0 * x) * x**2


def test_step_is_one_function(evaluate):
    t, language = evaluate("STEP(TIME, 0.5, -1, 1.5, 3)")
    expected = np.array([-1 + 4 * cubic(x - 0.5) for x in t])
    np.testing.assert_allclose(language, expected, atol=1e-14)
    motion = step(0.5, -1.0, 1.5, 3.0)
    np.testing.assert_allclose([motion(x) for x in t], expected, atol=1e-14)
    np.testing.assert_allclose([-1 + 4 * smooth_step(x - 0.5, 0)[1] for x in t], expected, atol=1e-14)
    # the friction coefficient over the sliding speed falls by the same step
    speeds = np.linspace(0.51, 1.49, 20)
    found = [friction_law(FRICTION_ADAMS, 3.0, 1.0, 0.5, 1.5, v)[0] * v for v in speeds]
    np.testing.assert_allclose(found, [3 - 2 * cubic(v - 0.5) for v in speeds], atol=1e-14)


@pytest.mark.parametrize("rate", [-2000.0, -1.0, 0.0, 2.0])
def test_impact_is_one_law(evaluate, rate):
    """F = max(0, K p^e + C p' S(p/d)) for p > 0: the kernel of the contact and IMPACT of the function language."""
    k, e, c, d = 500.0, 1.3, 4.0, 0.4
    t, language = evaluate(f"IMPACT(1 - TIME, {-rate!r}, 1, {k}, {e}, {c}, {d}) + 0*TIME")
    # IMPACT(q, q', q1, ...) has p = q1 - q = t and p' = -q'
    expected = [max(0.0, k * p**e + c * rate * cubic(p / d)) if p > 0 else 0.0 for p in t]
    kernel = [normal_law(LAW_IMPACT, k, e, c, d, p, rate)[0] for p in t]
    np.testing.assert_allclose(kernel, expected, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(language, kernel, rtol=1e-13, atol=1e-12)


def pressure(law: ContactLaw, depth: float, rate: float, share: float = 1.0, damping: float | None = None) -> float:
    """Return the force of a law where a share of the face is at work."""
    code = LAW_KINDS[law.kind].code
    c = damping_of_share(code, law.damping if damping is None else damping, share)
    return normal_law(code, share * law.stiffness, law.exponent, c, law.depth, depth, rate)[0]


@pytest.mark.slow
def test_no_other_place_asks_for_the_kind_of_a_law():
    """What is known of a kind is in its row: a comparison elsewhere leaves out a kind that is added later."""
    texts = {p.relative_to(PACKAGE).as_posix(): p.read_text(encoding="utf-8") for p in PACKAGE.rglob("*.py")}

    def files(pattern):
        return {name for name, text in texts.items() if re.search(pattern, text)}

    codes = "|".join(name for name in vars(law_kinds) if name.startswith("LAW_") and name != "LAW_KINDS")
    # an ideal mesh is damped as IMPACT is
    assert files(rf"\b({codes})\b") == {"contact/law_kinds.py", "contact/laws.py", "contact/ideal.py"}
    assert files(r"\b(law|contact)\.kind (==|!=|in|not in) ") == set()
    assert files('"hunt-crossley"') == {"contact/law_kinds.py", "gears/mesh.py"}


def test_laws_differ_by_their_rows(law):
    codes = sorted({row.code for row in LAW_KINDS.values()})
    assert codes == list(range(len(codes)))
    found = [normal_law(code, 3e9, 1.3, law.damping, 30e-6, *STATE)[0] for code in codes]
    assert len(set(found)) == len(codes)


def test_a_share_of_the_face_has_that_share_of_the_force(law):
    assert pressure(law, *STATE, share=0.3) == pytest.approx(0.3 * pressure(law, *STATE), rel=1e-12)


def test_helical_teeth_press_along_the_normal(law):
    """The law in the transverse section, per width, is that along the normal at the cosine's penetration and rate."""
    cosine, width = 0.9, 0.02
    row, (depth, rate) = LAW_KINDS[law.kind], STATE
    section = replace(law, stiffness=law.stiffness * cosine**law.exponent / width, depth=law.depth / cosine)
    found = pressure(section, depth, rate, damping=law.damping * row.section_damping(cosine, width))
    assert found == pytest.approx(pressure(law, cosine * depth, cosine * rate) / width, rel=1e-12)


def test_damping_of_a_tooth_pair_is_the_slope_by_the_rate(law):
    model, force, share = ContactModel(law), 900.0, 0.7
    depth, h = model.penetration(force, share=share), 1e-5
    slope = (pressure(law, depth, h, share) - pressure(law, depth, -h, share)) / (2 * h)
    assert model.tangent_damping(force, share) == pytest.approx(slope, rel=1e-9)
    assert slope > 0.0


def test_decks_hold_impact_and_nothing_else(law):
    refused, _ = REFUSED["ContactLaw.kind"]
    pair = GearPair.paper(contact=law)
    assert refused(pair) == (LAW_KINDS[law.kind].code != LAW_IMPACT)
    if refused(pair):
        with pytest.raises(ModelError, match=says("'mesh'", repr(law.kind), "ContactLaw.impact")):
            normal_law_of("mesh", pair)
    else:
        assert normal_law_of("mesh", pair).full_depth == law.depth


def test_a_description_makes_every_kind(law):
    row = LAW_KINDS[law.kind]
    needed = {"linear": {"stiffness": "3e8 N/m"}, "": {"stiffness": 3e9, "exponent": 1.3, "damping": 0.0}}
    assert contact_law({"kind": law.kind, **needed.get(row.maker, {})}).kind == law.kind
    assert row.damping_unit in str(law) or row.is_impact
    with pytest.raises(ValueError, match=says("ContactLaw.kind", "'ruber'", "'impact'")):
        replace(law, kind="ruber")


def test_no_load_damps_as_half_the_depth_does():
    assert ContactModel(ContactLaw.impact(damping=8.0)).tangent_damping(0.0) == pytest.approx(4.0)
    assert ContactModel(ContactLaw.hunt_crossley()).tangent_damping(0.0) == 0.0

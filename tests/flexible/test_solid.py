"""Meshes made and assembled by scikit-fem."""

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse.linalg

from gearmbs.flexible import ElasticMaterial, FlexibleError, Interface, check_model, reduce_model
from gearmbs.flexible.reduction import RESTARTS
from gearmbs.flexible.solid import block_mesh, nodes_where, ring_mesh, solid_model

skfem = pytest.importorskip("skfem")


@pytest.mark.slow
def test_a_free_bar_of_solids_bends_and_stretches_as_a_bar():
    length, depth, e, rho = 1.0, 0.05, 2e11, 7800.0
    model = solid_model(block_mesh((depth, depth, length), (1, 1, 10)), ElasticMaterial(e, 0.0, rho))
    report = check_model(model, 10)
    assert report.good
    np.testing.assert_allclose(report.properties.mass, rho * depth**2 * length, rtol=1e-12)
    np.testing.assert_allclose(report.properties.com, [depth / 2, depth / 2, length / 2], rtol=1e-9)
    frequencies = report.frequencies[6:]
    # Euler-Bernoulli less what shear and rotary inertia take, half a per cent
    bending = 22.3733 / (2 * np.pi * length**2) * np.sqrt(e * depth**2 / 12 / rho)
    np.testing.assert_allclose(frequencies[:2], bending, rtol=0.02)
    stretching = np.sqrt(e / rho) / (2 * length)
    assert np.abs(frequencies / stretching - 1).min() < 1e-3


@pytest.mark.slow
def test_a_thin_ring_has_the_frequencies_of_the_closed_form():
    """w_n^2 = E I n^2 (n^2 - 1)^2 / (rho A R^4 (n^2 + 1)) in the plane of the ring."""
    radius, thick, wide, e, rho = 0.2, 0.01, 0.02, 2.1e11, 7850.0
    model = solid_model(
        ring_mesh(2 * radius - thick, 2 * radius + thick, wide, (1, 32, 1)), ElasticMaterial(e, 0.3, rho)
    )
    frequencies = check_model(model, 8).frequencies[6:]
    for n in (2, 3):
        closed = np.sqrt(e * thick**2 / 12 * n**2 * (n**2 - 1) ** 2 / (rho * radius**4 * (n**2 + 1))) / (2 * np.pi)
        assert np.sum(np.abs(frequencies / closed - 1) < 0.02) == 2


@pytest.mark.slow
@pytest.mark.parametrize("thickness", [0.02, 0.002, 0.0004])
def test_modes_of_thin_plates_take_few_iterations(monkeypatch, thickness):
    """Against all eigenvalues, as far as these are known: to the roundoff of the largest."""
    model = solid_model(block_mesh((0.3, 0.2, thickness), (6, 4, 1)))
    every = scipy.linalg.eigh(model.stiffness.toarray(), model.mass.toarray(), eigvals_only=True)
    expected, known = every[6:12], 4 * np.finfo(float).eps * every[-1]
    eigsh = scipy.sparse.linalg.eigsh
    # what does not converge so soon is raised
    monkeypatch.setattr(scipy.sparse.linalg, "eigsh", lambda *a, **b: eigsh(*a, **{**b, "maxiter": RESTARTS}))
    found = (2 * np.pi * check_model(model).frequencies[6:]) ** 2
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=known)


def test_a_housing_with_seats():
    model = solid_model(block_mesh(("200 mm", "100 mm", "20 mm"), (4, 2, 1)), quadratic=False)
    left = Interface("left", nodes_where(model, lambda x, y, z: x < 1e-9))
    right = Interface("right", nodes_where(model, lambda x, y, z: x > 0.2 - 1e-9), "average")
    reduced = reduce_model(model, [left, right], modes=8)
    assert reduced.modes == 8 + 6
    np.testing.assert_allclose(reduced.place("right"), [0.2, 0.05, 0.01])
    assert reduced.faces is not None


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: block_mesh((1.0, 0.0, 1.0)), "three positive lengths"),
        (lambda: ring_mesh(0.2, 0.1, 0.1), "0 < inner < outer"),
        (lambda: solid_model(skfem.MeshTri()), "hexahedra or tetrahedra"),
        (lambda: nodes_where(solid_model(block_mesh((1, 1, 1), (1, 1, 1))), lambda x, y, z: x > 2), "no node meets"),
    ],
)
def test_wrong_meshes_are_named(make, message):
    with pytest.raises(FlexibleError, match=message):
        make()


@pytest.mark.parametrize("quadratic", [True, False])
@pytest.mark.parametrize("kind", ["MeshHex", "MeshTet"])
def test_matrices_are_those_of_scikit_fem(kind, quadratic):
    """To the rounding of sums over elements, on a skew mesh; entries that are zero there are rounding here."""
    from skfem.helpers import ddot, dot, eye, sym_grad, trace

    material = ElasticMaterial(2.0e11, 0.28, 7800.0)
    mesh = getattr(skfem, kind).init_tensor(*(np.linspace(0.0, a, 3) for a in (0.3, 0.2, 0.1)))
    mesh = type(mesh)(mesh.p + 0.1 * np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]]) @ mesh.p**2, mesh.t)
    kinds = {"MeshHex": (skfem.ElementHex1, skfem.ElementHex2), "MeshTet": (skfem.ElementTetP1, skfem.ElementTetP2)}
    basis = skfem.Basis(mesh, skfem.ElementVector(kinds[kind][quadratic]()), intorder=5)
    mu, nu = material.shear_modulus, material.poisson_ratio
    lame = material.youngs_modulus * nu / ((1 + nu) * (1 - 2 * nu))

    @skfem.BilinearForm
    def stiffness(u, v, _):
        strain = sym_grad(u)
        return ddot(2.0 * mu * strain + lame * eye(trace(strain), 3), sym_grad(v))

    @skfem.BilinearForm
    def inertia(u, v, _):
        return material.density * dot(u, v)

    model = solid_model(mesh, material, quadratic=quadratic)
    for own, form in ((model.stiffness, stiffness), (model.mass, inertia)):
        theirs = form.assemble(basis).toarray()
        bound = basis.dx.shape[1] * basis.Nbfun * np.finfo(float).eps * np.abs(theirs).max()
        assert np.abs(own.toarray() - theirs).max() < bound

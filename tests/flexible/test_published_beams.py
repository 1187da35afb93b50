"""Beams whose frequencies other programs printed, built here from the data of their models."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp

from gearmbs.flexible import ElasticMaterial, Shaft, ShaftSection, reduce_model
from gearmbs.flexible.beam import BeamSection

SIDE = 0.01


class SquareBar(Shaft):
    def element_section(self, a: float, b: float) -> BeamSection:
        return BeamSection.rectangle(self.material, SIDE, SIDE)


def test_reduced_beam_has_the_modes_of_a_modal_neutral_file():
    """Both ends are interfaces, six modes with them held are kept, as ANSYS 16 did; the rigid motions are left out.

    The numbers are of ADAMS's dump of the file, tests/data/siso_beam.mtx of github.com/Qxxx1xx/MnfParser at cd51b84,
    blocks 6 and 7: 1 m of 10 mm by 10 mm in 100 elements. Its nodes have masses and, alike in all directions, inertias.
    """
    material = ElasticMaterial(6.895e10, 0.33, 2766.7)
    model = SquareBar([ShaftSection(1.0, SIDE)], [], {"a": 0.0, "b": 1.0}, material, elements=100).model()
    share = np.r_[0.5, np.ones(99), 0.5] / 100
    lumps = share[:, None] * material.density * np.array([SIDE**2] * 3 + [SIDE**4 / 6] * 3)
    lumped = replace(model, mass=sp.diags_array(lumps.ravel()).tocsc(), slices=None, recovery=None)
    body = lumped.mass_properties()
    np.testing.assert_allclose(body.mass, 0.27667, rtol=1e-9)
    about_end = body.inertia[0, 0] + body.mass * body.com[2] ** 2
    np.testing.assert_allclose([body.inertia[2, 2], about_end], [4.6112e-6, 0.0922325557], rtol=1e-5)
    found = reduce_model(lumped, modes=6).frequencies
    bending = np.array([51.293258256, 141.80841063, 277.58861387, 833.70845624, 1316.6415664])
    np.testing.assert_allclose(found[:10].reshape(5, 2), np.column_stack([bending, bending]), rtol=4e-4)
    # ANSYS finds the torsion constant of a section by cells
    assert found[10] == pytest.approx(1560.9570195, rel=0.01)
    # two masses at the ends of the bar, as if it stretched evenly
    assert found[11] == pytest.approx(2752.0316846, rel=1e-8)


@pytest.mark.filterwarnings("ignore:ElasticMaterial:UserWarning")
def test_cantilever_has_the_frequencies_of_nastran():
    """Ten elements with lumped masses, the last a CBEAM that lumps its polar inertia, too; a mass at the end; inches.

    The numbers are MSC.Nastran's real eigenvalues, models/beam_modes/beam_modes.f06 of
    github.com/SteveDoyle2/pyNastran at c811c71.
    """
    density = 7.4851e-4
    material = ElasticMaterial(3e7, 0.29, density, shear_modulus=1.1628e7)
    model = Shaft([ShaftSection(10.0, 2.0)], [], {}, material, elements=10, shear=0.9).model()
    mass = np.zeros((11, 6))
    mass[:, :3] = density * np.pi * np.r_[0.5, np.ones(9), 0.5][:, None]
    mass[9:, 5] = density * np.pi / 4
    mass[10] += 2.59e-3
    # most rotations have no mass: the inverse problem, of the nodes that are not held
    squares = scipy.linalg.eigh(np.diag(mass.ravel()[6:]), model.stiffness.toarray()[6:, 6:], eigvals_only=True)
    found = 1 / (2 * np.pi * np.sqrt(squares[::-1][:10]))
    bending = [456.6603, 2674.587, 6626.104, 11111.58]
    # half a unit of the last of seven digits, of numbers that begin with a 1
    np.testing.assert_allclose(found, np.sort([*bending, *bending, 3554.923, 4507.487]), rtol=5e-7)

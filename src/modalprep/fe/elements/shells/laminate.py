"""Section of a shell: stiffness A, B, D, transverse shear S and mass per area, classical laminate theory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from modalprep.fe.properties.materials import Material, Orthotropic
from modalprep.fe.properties.properties import Ply, Shell


@dataclass(frozen=True, eq=False)
class ShellSection:
    """Stiffness and mass of a shell per area, about its mid-surface, in its material axes.

    Attributes
    ----------
    A, B, D : (3, 3)
        Membrane N/m, coupling N, bending N m; strains ``xx, yy, xy`` (engineering shear).
    S : (2, 2)
        Transverse shear ``xz, yz``, N/m.
    mass, first, second : float
        ``int rho (1, z, z^2) dz``: kg/m^2, kg/m, kg.
    third : (3, 3)
        Third moments ``int Q z^3 dz`` of the moduli, N m^2.

    Examples
    --------
    >>> steel = Material(E=200e9, nu=0.3, rho=7800.0)
    >>> one = shell_section(Shell(material=steel, thickness=0.01))
    >>> two = shell_section(Shell(plies=(Ply(material=steel, thickness=0.004), Ply(material=steel, thickness=0.006))))
    >>> all(bool(np.allclose(getattr(one, k), getattr(two, k), atol=1e-3)) for k in ("A", "B", "D", "S"))
    True
    """

    A: np.ndarray
    B: np.ndarray
    D: np.ndarray
    S: np.ndarray
    mass: float
    first: float
    second: float
    third: np.ndarray

    @property
    def lift(self) -> float:
        """Height of the mass over the mid-surface, m; zero without mass."""
        return self.first / self.mass if self.mass else 0.0


def shell_section(shell: Shell) -> ShellSection:
    """Return the section of a homogeneous sheet or a laminate; an analytic function of moduli and thicknesses."""
    return _laminate(shell) if shell.plies else _sheet(shell)


def section_moduli(s: ShellSection, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return ``[[A, B], [B, D]] (ne or 1, 6, 6)`` and ``S (ne or 1, 2, 2)``, material axes at ``angle (ne,)``, rad."""
    if np.ptp(angle) == 0 or _isotropic(s):
        angle = angle[:1]
    T = np.zeros((len(angle), 6, 6))
    T[:, :3, :3] = T[:, 3:, 3:] = strain_rotation(angle)
    return T.transpose(0, 2, 1) @ np.block([[s.A, s.B], [s.B, s.D]]) @ T, rotated_shear(s.S, angle)


def total_thickness(shell: Shell) -> float:
    """Return the thickness of a sheet or of all plies, m."""
    return shell.thickness or sum(ply.thickness for ply in shell.plies)


def _sheet(shell: Shell) -> ShellSection:
    t = shell.thickness
    material = _of_sheet(shell)
    bending = shell.bending_material or material
    shear = shell.shear_material or material
    return ShellSection(
        A=t * plane_stress(material),
        B=np.zeros((3, 3)),
        D=t**3 / 12 * shell.bending_ratio * plane_stress(bending),
        S=shell.shear_ratio * t * _shear_moduli(shear),
        mass=material.rho * t + shell.nsm,
        first=0.0,
        second=material.rho * t**3 / 12,
        third=np.zeros((3, 3)),
    )


def _of_sheet(shell: Shell) -> Material | Orthotropic:
    assert shell.material is not None  # a shell has plies or a material
    return shell.material


def faces(shell: Shell) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return, of the top and the bottom face, moduli ``(3, 3)`` of membrane strain (Pa) and of curvature (Pa m).

    ``xx, yy, xy`` in material axes; those of a laminate are of its outermost plies.

    Examples
    --------
    >>> stretched, bent = faces(Shell(material=Material(E=200e9, nu=0.0, rho=1.0), thickness=0.01))["bottom"]
    >>> stretched[0], bent[0]
    (array([2.e+11, 0.e+00, 0.e+00]), array([-1.e+09, -0.e+00, -0.e+00]))
    """
    if not shell.plies:
        material = _of_sheet(shell)
        stretched, bent = (plane_stress(m) for m in (material, shell.bending_material or material))
        return {"top": (stretched, shell.thickness / 2 * bent), "bottom": (stretched, -shell.thickness / 2 * bent)}
    half = sum(ply.thickness for ply in shell.plies) / 2
    Q = [rotated_moduli(plane_stress(ply.material), ply.angle) for ply in (shell.plies[-1], shell.plies[0])]
    return {"top": (Q[0], half * Q[0]), "bottom": (Q[1], -half * Q[1])}


def _laminate(shell: Shell) -> ShellSection:
    t = np.array([ply.thickness for ply in shell.plies])
    z = np.concatenate([[0.0], np.cumsum(t)]) - t.sum() / 2
    Q = np.array([rotated_moduli(plane_stress(ply.material), ply.angle) for ply in shell.plies])
    rho = np.array([ply.material.rho for ply in shell.plies])
    moment = [(z[1:] ** k - z[:-1] ** k) / k for k in (1, 2, 3, 4)]
    A, B, D, F = (np.einsum("p,pab->ab", m, Q) for m in moment)
    mass, first, second = (rho @ m for m in moment[:3])
    return ShellSection(A, B, D, _laminate_shear(shell.plies, Q, z), mass + shell.nsm, first, second, F)


def _laminate_shear(plies: tuple[Ply, ...], Q: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Shear stiffness from the energy of the shear stress that equilibrium requires in cylindrical bending.

    ``S = D^2 / int g^2 / G dz`` with ``g(z) = int Q (z - z_n) dz`` from the bottom; a homogeneous sheet gives
    5/6 G t exactly, a sandwich the stiffness of its core.
    """
    G = np.array([rotated_shear(_shear_moduli(ply.material), ply.angle) for ply in plies])
    S = np.diag([_energy_shear(Q[:, a, a], 1 / np.linalg.inv(G)[:, a, a], z) for a in range(2)])
    plain = np.einsum("p,pab->ab", np.diff(z), G)
    S[0, 1] = S[1, 0] = plain[0, 1] * np.sqrt(S[0, 0] * S[1, 1] / (plain[0, 0] * plain[1, 1]))
    return S


def _energy_shear(Q: np.ndarray, G: np.ndarray, z: np.ndarray) -> np.ndarray:
    neutral = Q @ (z[1:] ** 2 - z[:-1] ** 2) / 2 / (Q @ np.diff(z))
    low = z[:-1] - neutral
    high = z[1:] - neutral
    D = Q @ (high**3 - low**3) / 3
    before = np.concatenate([[0.0], np.cumsum(Q * (high**2 - low**2) / 2)])[:-1]
    point, weight = np.polynomial.legendre.leggauss(3)  # g^2 is of degree 4
    at = (low + high)[:, None] / 2 + np.outer(high - low, point) / 2
    g = before[:, None] + Q[:, None] * (at**2 - low[:, None] ** 2) / 2
    return D**2 / np.sum((high - low) / 2 / G * (g**2 @ weight))


def plane_stress(material: Material | Orthotropic) -> np.ndarray:
    """Return the plane-stress moduli ``(3, 3)`` in Pa of ``xx, yy, xy``, material axes."""
    if isinstance(material, Material):
        E, nu = material.E, material.nu
        return E / (1 - nu**2) * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
    m = material
    nu21 = m.nu12 * m.E2 / m.E1
    Q = np.array([[m.E1, m.nu12 * m.E2, 0], [m.nu12 * m.E2, m.E2, 0], [0, 0, 0]]) / (1 - m.nu12 * nu21)
    Q[2, 2] = m.G12
    return Q


def _shear_moduli(material: Material | Orthotropic) -> np.ndarray:
    if isinstance(material, Material):
        return material.G * np.eye(2)
    return np.diag([material.G13, material.G23])


def rotated_moduli(Q: np.ndarray, angle: np.ndarray | float) -> np.ndarray:
    """Return plane moduli ``(..., 3, 3)`` in axes from which the material axes are rotated by `angle` (rad)."""
    T = strain_rotation(angle)
    return np.swapaxes(T, -1, -2) @ Q @ T


def rotated_shear(G: np.ndarray, angle: np.ndarray | float) -> np.ndarray:
    """Return shear moduli ``(..., 2, 2)`` in axes from which the material axes are rotated by `angle` (rad)."""
    c = np.cos(angle)
    s = np.sin(angle)
    R = np.moveaxis(np.array([[c, s], [-s, c]]), (0, 1), (-2, -1))
    return np.swapaxes(R, -1, -2) @ G @ R


def strain_rotation(angle: np.ndarray | float) -> np.ndarray:
    """Return ``(..., 3, 3)``: strains ``xx, yy, xy`` to those in axes rotated by `angle` (rad).

    Examples
    --------
    >>> np.round(strain_rotation(np.pi / 2) @ [1.0, 2.0, 3.0], 12)
    array([ 2.,  1., -3.])
    """
    c = np.cos(angle)
    s = np.sin(angle)
    T = np.array([[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2 * c * s, 2 * c * s, c * c - s * s]])
    return np.moveaxis(T, (0, 1), (-2, -1))


def _isotropic(s: ShellSection) -> bool:
    """Whether the stiffness of the section is the same in axes rotated by any angle."""
    T = strain_rotation(0.5)
    alike = [np.abs(T.T @ Q @ T - Q).max() <= 1e-12 * np.abs(Q).max() for Q in (s.A, s.B, s.D)]
    return all(alike) and bool(np.abs(s.S - s.S[0, 0] * np.eye(2)).max() <= 1e-12 * s.S[0, 0])

"""SE(2) and SE(3) against matrix exponential and logarithm, scipy's Rotation, and group laws."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm, logm
from scipy.spatial.transform import Rotation

from geometric_locomotion import lie
from geometric_locomotion.types import Floats

ANGLES = (0.0, 1e-12, 1e-8, 1e-4, 0.0199, 0.0201, 0.5, 2.0, 3.0, np.pi - 1e-4, np.pi - 1e-9)
"""Turns [rad]: near zero, on both sides of the place where the series ends, near pi."""


def matrix_2(twist: Floats) -> Floats:
    vx, vy, turn = twist
    return np.array([[0, -turn, vx], [turn, 0, vy], [0, 0, 0]])


def matrix_3(twist: Floats) -> Floats:
    matrix = np.zeros((4, 4))
    matrix[:3, :3] = np.cross(np.eye(3), twist[3:])
    matrix[:3, 3] = twist[:3]
    return matrix


def planar(count: int, seed: int = 1) -> Floats:
    rng = np.random.default_rng(seed)
    twists = rng.normal(size=(count, 3))
    twists[:, 2] = rng.uniform(-np.pi, np.pi, count)
    return twists


def spatial(count: int, seed: int = 2) -> Floats:
    rng = np.random.default_rng(seed)
    twists = rng.normal(size=(count, 6))
    axes = twists[:, 3:] / np.linalg.norm(twists[:, 3:], axis=1, keepdims=True)
    twists[:, 3:] = axes * rng.uniform(0, np.pi, (count, 1))
    return twists


@pytest.mark.parametrize("angle", ANGLES)
def test_exp_is_that_of_the_matrix(angle: float) -> None:
    for twist in planar(5):
        twist[2] = angle
        np.testing.assert_allclose(lie.se2_exp(twist), expm(matrix_2(twist)), atol=1e-13)
    for twist in spatial(5):
        twist[3:] *= angle / np.linalg.norm(twist[3:])
        np.testing.assert_allclose(lie.se3_exp(twist), expm(matrix_3(twist)), atol=1e-13)


@pytest.mark.parametrize("angle", [1e-4, 0.5, 2.0, 3.0])
def test_log_is_that_of_the_matrix(angle: float) -> None:
    for twist in spatial(5):
        twist[3:] *= angle / np.linalg.norm(twist[3:])
        pose = np.asarray(expm(matrix_3(twist)), dtype=float)
        np.testing.assert_allclose(matrix_3(lie.se3_log(pose)), np.real(logm(pose)), atol=1e-8)
    for twist in planar(5):
        twist[2] = angle
        pose = np.asarray(expm(matrix_2(twist)), dtype=float)
        np.testing.assert_allclose(matrix_2(lie.se2_log(pose)), np.real(logm(pose)), atol=1e-8)


@pytest.mark.parametrize("angle", ANGLES)
def test_log_undoes_exp(angle: float) -> None:
    plane, space = planar(50), spatial(50)
    plane[:, 2] = angle
    space[:, 3:] *= angle / np.linalg.norm(space[:, 3:], axis=1, keepdims=True)
    np.testing.assert_allclose(lie.se2_log(lie.se2_exp(plane)), plane, atol=1e-12)
    np.testing.assert_allclose(lie.se3_log(lie.se3_exp(space)), space, atol=1e-12)


def test_half_turns_about_any_axis_have_a_log() -> None:
    axes = spatial(100)[:, 3:]
    axes = np.concatenate([axes, np.eye(3), -np.eye(3)])
    axes *= np.pi / np.linalg.norm(axes, axis=1, keepdims=True)
    turns = lie.so3_exp(axes)
    rotations = lie.so3_log(turns)
    np.testing.assert_allclose(np.linalg.norm(rotations, axis=1), np.pi, atol=1e-12)
    np.testing.assert_allclose(lie.so3_exp(rotations), turns, atol=1e-12)


def test_rotations_are_those_of_scipy() -> None:
    rotations = spatial(200)[:, 3:]
    matrices = Rotation.from_rotvec(rotations).as_matrix()
    np.testing.assert_allclose(lie.so3_exp(rotations), matrices, atol=1e-14)
    np.testing.assert_allclose(lie.so3_log(matrices), rotations, atol=1e-12)


def test_leading_axes_are_worked_over() -> None:
    plane, space = planar(12).reshape(3, 4, 3), spatial(12).reshape(3, 4, 6)
    for exp, log, twists in (
        (lie.se2_exp, lie.se2_log, plane),
        (lie.se3_exp, lie.se3_log, space),
    ):
        poses = exp(twists)
        assert (poses[2, 1] == exp(twists[2, 1])).all()
        np.testing.assert_allclose(log(poses), twists, atol=1e-12)


def test_a_pose_times_its_inverse_is_the_identity() -> None:
    plane, space = lie.se2_exp(planar(20)), lie.se3_exp(spatial(20))
    np.testing.assert_allclose(
        plane @ lie.se2_inverse(plane), np.eye(3)[None].repeat(20, 0), atol=1e-14
    )
    np.testing.assert_allclose(
        space @ lie.se3_inverse(space), np.eye(4)[None].repeat(20, 0), atol=1e-14
    )


def test_the_adjoint_conjugates() -> None:
    """exp(Ad(g) xi) = g exp(xi) g^-1, and Ad(g h) = Ad(g) Ad(h)."""
    for exp, inverse, adjoint, twists, size in (
        (lie.se2_exp, lie.se2_inverse, lie.se2_adjoint, planar(20), 3),
        (lie.se3_exp, lie.se3_inverse, lie.se3_adjoint, spatial(20), 6),
    ):
        poses = exp(twists)
        inner = 0.3 * twists[::-1]
        moved = (adjoint(poses) @ inner[..., None])[..., 0]
        assert moved.shape == (20, size)
        np.testing.assert_allclose(exp(moved), poses @ exp(inner) @ inverse(poses), atol=1e-12)
        other = poses[::-1]
        np.testing.assert_allclose(
            adjoint(poses @ other), adjoint(poses) @ adjoint(other), atol=1e-12
        )


def test_the_bracket_is_the_commutator() -> None:
    for a, b in zip(planar(10), planar(10, seed=4), strict=True):
        first, second = matrix_2(a), matrix_2(b)
        expected = first @ second - second @ first
        np.testing.assert_allclose(matrix_2(lie.se2_bracket(a, b)), expected, atol=1e-14)

"""A structured-light depth camera, as a model of its own.

In the order in which light goes: what the projector does not reach is lost in its shadow; steep and shiny sides return little; the
matched position jitters; disparity errs, and neighbours err together; disparity is quantised. The figures for disparity are those
of a real Kinect of the first kind on tables: sigma(1/z) = .0025 1/m, correlated by .8 at 1 px, .57 at 4, .34 at 8 and .26 at 16.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Correlation lengths (pixels) and shares of the variance whose sum has the measured correlation.
LENGTHS_PX, SHARES = (0.6, 3.5, 40.0), (0.30, 0.45, 0.25)
# Pixels of one hole hang together over about this length.
HOLE_LENGTH_PX = 1.6
# From here on the projector's column must fall behind to be in the shadow, pixels.
SHADOW_SLACK_PX = 0.6


@dataclass(frozen=True)
class DepthNoise:
    """How the camera falls short. `scale` 0 leaves shadow, quantisation and holes."""

    baseline_m: float = 0.075
    sigma_inverse_m: float = 0.0025
    disparity_steps: float = 8.0
    jitter_px: float = 0.45
    scale: float = 1.0
    # Share of pixels without a return on surfaces that face the camera; up to twice that on steep ones.
    holes: float = 0.002
    range_m: tuple[float, float] = (0.5, 6.0)


def field(rng: np.random.Generator, shape: tuple[int, int], lengths: tuple[float, ...], shares: tuple[float, ...]) -> np.ndarray:
    """Gaussian noise of unit variance whose correlation at d pixels is the sum of share * exp(-d^2 / 4 length^2)."""
    rows, columns = np.fft.fftfreq(shape[0])[:, None], np.fft.rfftfreq(shape[1])[None, :]
    squared = (2.0 * np.pi) ** 2 * (rows**2 + columns**2)
    twice = np.full(columns.shape, 2.0)
    twice[0, 0] = 1.0
    power = 0.0
    for length, share in zip(lengths, shares):
        part = np.exp(-(length**2) * squared)
        power = power + share * part / ((part * twice).sum() / (shape[0] * shape[1]))
    white = np.fft.rfft2(rng.standard_normal(shape, dtype=np.float32))
    return np.fft.irfft2(white * np.sqrt(power), s=shape)


def steepness_deg(depth_m: np.ndarray, focal_px: float) -> np.ndarray:
    """Angle between each pixel's surface and the ray that meets it, 0 where it faces the camera. From the nearer neighbours."""
    height, width = depth_m.shape
    u = (np.arange(width) - 0.5 * (width - 1))[None, :] / focal_px
    v = (np.arange(height) - 0.5 * (height - 1))[:, None] / focal_px

    def slope(axis: int) -> np.ndarray:
        z = depth_m
        ahead = np.diff(z, axis=axis, append=np.nan)
        back = np.diff(z, axis=axis, prepend=np.nan)
        ahead, back = (np.where(np.isnan(d), np.inf, d) for d in (ahead, back))
        least = np.where(np.abs(ahead) < np.abs(back), ahead, back)
        return np.where(np.isinf(least), 0.0, least) * focal_px

    # For z(u, v) the normal is (dz/du, dz/dv, -(z + u dz/du + v dz/dv)) with u, v in units of the focal length.
    across, down = slope(1), slope(0)
    along = depth_m + u * across + v * down
    cosine = depth_m / np.sqrt((across**2 + down**2 + along**2) * (1.0 + u**2 + v**2))
    return np.degrees(np.arccos(np.clip(np.nan_to_num(cosine, nan=1.0), 0.0, 1.0)))


def smooth(x: np.ndarray, low: float, high: float) -> np.ndarray:
    """0 up to `low`, 1 from `high` on, smooth between."""
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def shadow(depth_m: np.ndarray, focal_px: float, baseline_m: float) -> np.ndarray:
    """Pixels that the projector, a baseline to the right of the camera, does not reach: in its image something lies before them."""
    column = np.arange(depth_m.shape[1])[None, :] - focal_px * baseline_m / depth_m
    column = np.where(np.isnan(column), np.inf, column)
    nearest = np.minimum.accumulate(column[:, ::-1], axis=1)[:, ::-1]
    return column > nearest + SHADOW_SLACK_PX


def share_lost(depth_m: np.ndarray, shine: np.ndarray, focal_px: float, holes: float) -> np.ndarray:
    """Share of pixels without a return, pixel by pixel."""
    angle = steepness_deg(depth_m, focal_px)
    facing = holes * (1.0 + smooth(angle, 50.0, 80.0))
    steep = smooth(angle, 72.0, 86.0)
    shiny = shine * smooth(angle, 30.0, 65.0) * 0.8
    return 1.0 - (1.0 - np.clip(facing, 0.0, 1.0)) * (1.0 - steep) * (1.0 - shiny)


def observe(depth_m: np.ndarray, shine: np.ndarray, focal_px: float, noise: DepthNoise, seed: tuple[int, ...]) -> np.ndarray:
    """What the camera reports for an ideal depth image: metres along z, NaN where nothing returns.

    `shine` is 0 to 1 by pixel. The same seed gives the same image.
    """
    rng = np.random.default_rng(list(seed))
    shape = depth_m.shape
    lost = shadow(depth_m, focal_px, noise.baseline_m)
    share = share_lost(depth_m, shine, focal_px, noise.holes)
    threshold = field(rng, shape, (HOLE_LENGTH_PX,), (1.0,))
    lost |= normal_share(threshold) < share
    rows, columns = np.indices(shape)
    moved = [noise.scale * noise.jitter_px * field(rng, shape, (1.0,), (1.0,)) for _ in range(2)]
    rows = np.clip(np.rint(rows + moved[0]).astype(int), 0, shape[0] - 1)
    columns = np.clip(np.rint(columns + moved[1]).astype(int), 0, shape[1] - 1)
    seen = depth_m[rows, columns]
    product = focal_px * noise.baseline_m
    disparity = product * (1.0 / seen + noise.scale * noise.sigma_inverse_m * field(rng, shape, LENGTHS_PX, SHARES))
    disparity = np.rint(disparity * noise.disparity_steps) / noise.disparity_steps
    with np.errstate(divide="ignore", invalid="ignore"):
        out = product / disparity
    good = ~lost & (out >= noise.range_m[0]) & (out <= noise.range_m[1])
    return np.where(good, out, np.nan).astype(np.float32)


def normal_share(x: np.ndarray) -> np.ndarray:
    """The standard normal distribution's integral up to x (Abramowitz and Stegun 26.2.17, error below 1e-7)."""
    t = 1.0 / (1.0 + 0.2316419 * np.abs(x))
    series = t * (0.319381530 + t * (-0.356563782 + t * (1.781477937 + t * (-1.821255978 + t * 1.330274429))))
    tail = np.exp(-0.5 * x * x) / np.sqrt(2.0 * np.pi) * series
    return np.where(x >= 0.0, 1.0 - tail, tail)

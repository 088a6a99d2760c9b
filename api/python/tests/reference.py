"""gsplat's rasterization by loops in binary64, written from its source: projection and harmonics as its torch code has them, lists of
pixels and compositing as its CUDA code has them."""

from __future__ import annotations

import numpy as np

TILE = 16
FLOOR = 1.0 / 255.0


def rotations(quats):
    w, x, y, z = (quats / np.linalg.norm(quats, axis=-1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1)


def harmonics(degree, directions, coefficients):
    """Colours of `[N, K, D]` coefficients seen along `[N, 3]` directions."""
    x, y, z = (directions / np.linalg.norm(directions, axis=-1, keepdims=True)).T
    basis = [np.full_like(x, 0.2820947917738781)]
    if degree > 0:
        basis += [-0.48860251190292 * y, 0.48860251190292 * z, -0.48860251190292 * x]
    if degree > 1:
        basis += [
            1.0925484305920792 * x * y,
            -1.0925484305920792 * y * z,
            0.31539156525252005 * (2 * z * z - x * x - y * y),
            -1.0925484305920792 * x * z,
            0.5462742152960396 * (x * x - y * y),
        ]
    if degree > 2:
        basis += [
            -0.5900435899266435 * y * (3 * x * x - y * y),
            2.890611442640554 * x * y * z,
            -0.4570457994644658 * y * (4 * z * z - x * x - y * y),
            0.3731763325901154 * z * (2 * z * z - 3 * x * x - 3 * y * y),
            -0.4570457994644658 * x * (4 * z * z - x * x - y * y),
            1.445305721320277 * z * (x * x - y * y),
            -0.5900435899266435 * x * (x * x - 3 * y * y),
        ]
    return np.maximum(np.einsum("kn,nkd->nd", np.array(basis), coefficients[:, : len(basis)]) + 0.5, 0.0)


def project(means, covariances, K, width, height, model):
    """Means and covariances on the screen of Gaussians in the camera's axes."""
    fx, fy, cx, cy = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
    x, y, z = means.T
    zero = np.zeros_like(x)
    if model == "ortho":
        jacobian = np.array([[fx + zero, zero, zero], [zero, fy + zero, zero]])
        centres = np.stack([fx * x + cx, fy * y + cy], axis=-1)
    else:
        margin = [0.3 * 0.5 * width / fx, 0.3 * 0.5 * height / fy]
        tx = z * np.clip(x / z, -(cx / fx + margin[0]), (width - cx) / fx + margin[0])
        ty = z * np.clip(y / z, -(cy / fy + margin[1]), (height - cy) / fy + margin[1])
        jacobian = np.array([[fx / z, zero, -fx * tx / z**2], [zero, fy / z, -fy * ty / z**2]])
        centres = np.stack([fx * x / z + cx, fy * y / z + cy], axis=-1)
    jacobian = jacobian.transpose(2, 0, 1)
    return centres, jacobian @ covariances @ jacobian.transpose(0, 2, 1)


def rasterize(means, quats, scales, opacities, colors, viewmat, K, width, height, **options):
    """`[H, W, D]` values, `[H, W]` alphas, `[H, W]` accumulated depths, and `[H, W]` where binary32 may decide otherwise."""
    near, far = options.get("near_plane", 0.01), options.get("far_plane", 1e10)
    eps, ceiling = options.get("eps2d", 0.3), options.get("ceiling", 0.99)
    model, degree = options.get("camera_model", "pinhole"), options.get("sh_degree")
    means, quats, scales, opacities, colors, viewmat, K = (
        np.asarray(array, np.float64) for array in (means, quats, scales, opacities, colors, viewmat, K)
    )
    if degree is not None:
        eye = -np.linalg.inv(viewmat[:3, :3]) @ viewmat[:3, 3]
        colors = harmonics(degree, means - eye, colors)
    axes = rotations(quats) * scales[:, None, :]
    turn = viewmat[:3, :3]
    seen = means @ turn.T + viewmat[:3, 3]
    depths = seen[:, 2]
    ahead = (depths > near) & (depths < far)
    covariances = turn @ (axes @ axes.transpose(0, 2, 1)) @ turn.T
    centres = np.zeros((len(means), 2))
    plane = np.tile(np.eye(2), (len(means), 1, 1))
    centres[ahead], plane[ahead] = project(seen[ahead], covariances[ahead], K, width, height, model)
    before = np.linalg.det(plane)
    plane = plane + eps * np.eye(2)
    after = np.linalg.det(plane)
    if options.get("rasterize_mode") == "antialiased":
        opacities = opacities * np.sqrt(np.maximum(before / after, options.get("ratio_floor", 0.0)))

    values = np.zeros((height, width, colors.shape[1]))
    transmittance = np.ones((height, width))
    accumulated = np.zeros((height, width))
    done = np.zeros((height, width), bool)
    undecided = np.zeros((height, width), bool)
    columns, rows = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    last = None
    for index in np.argsort(depths.astype(np.float32), kind="stable"):
        if not ahead[index] or opacities[index] < FLOOR:
            continue
        extent = min(3.33, np.sqrt(2.0 * np.log(opacities[index] / FLOOR)))
        radius = np.ceil(extent * np.sqrt(np.diagonal(plane[index])))
        x, y = centres[index]
        low = np.maximum(np.floor((centres[index] - radius) / TILE), 0) * TILE
        high = np.maximum(np.ceil((centres[index] + radius) / TILE), 0) * TILE
        inside = (columns > low[0]) & (columns < high[0]) & (rows > low[1]) & (rows < high[1])
        inverse = np.linalg.inv(plane[index])
        dx, dy = columns - x, rows - y
        sigma = 0.5 * (inverse[0, 0] * dx * dx + inverse[1, 1] * dy * dy) + inverse[0, 1] * dx * dy
        alpha = np.minimum(ceiling, opacities[index] * np.exp(-sigma))
        # Rounding to binary32 decides which side of a threshold a pixel is on, and the order of two at one depth.
        undecided |= inside & ~done & (np.abs(alpha / FLOOR - 1.0) < 2e-5 * (1.0 + sigma))
        if last is not None and abs(depths[index] / depths[last] - 1.0) < 2e-6:
            undecided |= inside & ~done & (alpha > FLOOR)
        last = index
        drawn = inside & ~done & (alpha >= FLOOR)
        after_it = transmittance * (1.0 - alpha)
        undecided |= drawn & (np.abs(after_it / 1e-4 - 1.0) < 1e-3)
        done |= drawn & (after_it <= 1e-4)
        drawn &= ~done
        weight = np.where(drawn, alpha * transmittance, 0.0)
        values += weight[..., None] * colors[index]
        accumulated += weight * depths[index]
        transmittance = np.where(drawn, after_it, transmittance)
    return values, 1.0 - transmittance, accumulated, undecided

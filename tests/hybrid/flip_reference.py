#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""FLIP of one small picture, straight from the paper's equations: two-dimensional kernels, no tricks, no libraries.

Prints the numbers that flip_test.cpp holds computeFlip against. Shares nothing with flip.cpp but the paper.
Source: Andersson et al., FLIP: A Difference Evaluator for Alternating Images, HPG 2020.
"""
import math

WIDTH, HEIGHT, PPD = 24, 16, 67.0
M = [[0.4123907993, 0.3575843394, 0.1804807884],
     [0.2126390059, 0.7151686788, 0.0721923154],
     [0.0193308187, 0.1191947798, 0.9505321522]]
WHITE = [sum(row) for row in M]


def pictures():
    """Colour ramps; the second with a brighter block, a thin line and one other pixel."""
    a = [[(x / 23.0, y / 15.0, ((x * 5 + y * 3) % 8) / 7.0) for x in range(WIDTH)] for y in range(HEIGHT)]
    b = [list(row) for row in a]
    for y in range(4, 9):
        for x in range(6, 12):
            b[y][x] = tuple(min(1.0, c + 0.25) for c in b[y][x])
    for y in range(HEIGHT):
        b[y][17] = (0.0, 0.0, 0.0)
    b[12][3] = (1.0, 0.0, 0.5)
    return a, b


def linear(c):
    return c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4


def xyz(rgb):
    return [sum(M[r][c] * rgb[c] for c in range(3)) for r in range(3)]


def inverse(m):
    (a, b, c), (d, e, f), (g, h, i) = m
    det = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    return [[(e * i - f * h) / det, (c * h - b * i) / det, (b * f - c * e) / det],
            [(f * g - d * i) / det, (a * i - c * g) / det, (c * d - a * f) / det],
            [(d * h - e * g) / det, (b * g - a * h) / det, (a * e - b * d) / det]]


def opponent(rgb):
    x, y, z = (v / w for v, w in zip(xyz(rgb), WHITE))
    return 116 * y - 16, 500 * (x - y), 200 * (y - z)


def from_opponent(c):
    y = (c[0] + 16) / 116
    x, z = c[1] / 500 + y, y - c[2] / 200
    t = [x * WHITE[0], y * WHITE[1], z * WHITE[2]]
    inv = inverse(M)
    return [sum(inv[r][k] * t[k] for k in range(3)) for r in range(3)]


def hunt_lab(rgb):
    def f(t):
        return t ** (1 / 3) if t > (6 / 29) ** 3 else t / (3 * (6 / 29) ** 2) + 4 / 29
    x, y, z = (f(v / w) for v, w in zip(xyz(rgb), WHITE))
    lightness = 116 * y - 16
    return lightness, 0.01 * lightness * 500 * (x - y), 0.01 * lightness * 200 * (y - z)


def hyab(a, b):
    return abs(a[0] - b[0]) + math.hypot(a[1] - b[1], a[2] - b[2])


def correlate(plane, kernel, radius):
    def at(x, y):
        return plane[min(max(y, 0), HEIGHT - 1)][min(max(x, 0), WIDTH - 1)]
    return [[sum(kernel[(i, k)] * at(x + i, y + k) for i in range(-radius, radius + 1) for k in range(-radius, radius + 1))
             for x in range(WIDTH)] for y in range(HEIGHT)]


def sensitivity(terms):
    radius = math.ceil(3 * math.sqrt(0.04 / (2 * math.pi ** 2)) * PPD)
    kernel = {}
    for i in range(-radius, radius + 1):
        for k in range(-radius, radius + 1):
            d2 = (i / PPD) ** 2 + (k / PPD) ** 2
            kernel[(i, k)] = sum(a * math.sqrt(math.pi / b) * math.exp(-math.pi ** 2 * d2 / b) for a, b in terms)
    total = sum(kernel.values())
    return {at: w / total for at, w in kernel.items()}, radius


def perceived(picture):
    planes = [[[opponent([linear(c) for c in p])[n] for p in row] for row in picture] for n in range(3)]
    terms = [[(1, 0.0047)], [(1, 0.0053)], [(34.1, 0.04), (13.5, 0.025)]]
    filtered = [correlate(plane, *sensitivity(t)) for plane, t in zip(planes, terms)]
    lab = [[hunt_lab([min(max(c, 0), 1) for c in from_opponent([filtered[n][y][x] for n in range(3)])])
            for x in range(WIDTH)] for y in range(HEIGHT)]
    return lab, planes[0]


def detector(weight):
    sigma = 0.5 * 0.082 * PPD
    radius = math.ceil(3 * sigma)
    kernel = {(i, k): weight(i, sigma) * math.exp(-(i * i + k * k) / (2 * sigma * sigma))
              for i in range(-radius, radius + 1) for k in range(-radius, radius + 1)}
    up = sum(w for w in kernel.values() if w > 0)
    down = -sum(w for w in kernel.values() if w < 0)
    return {at: w / (up if w > 0 else down) for at, w in kernel.items()}, radius


def features(achromatic):
    plane = [[(v + 16) / 116 for v in row] for row in achromatic]
    lengths = []
    for weight in (lambda i, s: -i, lambda i, s: i * i / (s * s) - 1):
        kernel, radius = detector(weight)
        gx = correlate(plane, kernel, radius)
        gy = correlate(plane, {(i, k): kernel[(k, i)] for i, k in kernel}, radius)
        lengths.append([[math.hypot(gx[y][x], gy[y][x]) for x in range(WIDTH)] for y in range(HEIGHT)])
    return lengths


def flip(a, b):
    (lab_a, y_a), (lab_b, y_b) = perceived(a), perceived(b)
    (edge_a, point_a), (edge_b, point_b) = features(y_a), features(y_b)
    largest = hyab(hunt_lab([0, 1, 0]), hunt_lab([0, 0, 1])) ** 0.7
    result = []
    for y in range(HEIGHT):
        row = []
        for x in range(WIDTH):
            c = hyab(lab_a[y][x], lab_b[y][x]) ** 0.7
            knee = 0.4 * largest
            c = 0.95 / knee * c if c < knee else 0.95 + (c - knee) / (largest - knee) * 0.05
            f = max(abs(edge_a[y][x] - edge_b[y][x]), abs(point_a[y][x] - point_b[y][x]))
            row.append(c ** (1 - (f / math.sqrt(2)) ** 0.5))
        result.append(row)
    return result


if __name__ == "__main__":
    shown = flip(*pictures())
    print("mean %.9f" % (sum(map(sum, shown)) / (WIDTH * HEIGHT)))
    for px, py in ((0, 0), (3, 12), (8, 6), (12, 6), (17, 8), (18, 2), (23, 15)):
        print("(%d, %d) %.9f" % (px, py, shown[py][px]))
    white, black = hunt_lab([1, 1, 1]), hunt_lab([0, 0, 0])
    peak = hyab(hunt_lab([0, 1, 0]), hunt_lab([0, 0, 1])) ** 0.7
    print("black to white %.9f" % (0.95 + (hyab(white, black) ** 0.7 / peak - 0.4) / 0.6 * 0.05))

// SPDX-License-Identifier: Apache-2.0
// FLIP's two pipelines, colour and feature, from the paper's equations. All kernels are products
// (or sums of products) of one-dimensional ones and run as such; normalisation is that of the
// two-dimensional kernel.
#include "hybrid/gbuffer/flip.h"

#include "cuda/error.h"
#include "cuda/parallel_for.h"
#include "hybrid/gbuffer/tone_map.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace shadowdag {
namespace {

constexpr double kPi = 3.14159265358979323846;
// Sec. 4.1.2 and 4.2 of the paper.
constexpr double kColorExponent = 0.7;   // q_c
constexpr double kKneeShare = 0.4;       // p_c
constexpr double kKneeValue = 0.95;      // p_t
constexpr double kFeatureWidth = 0.082;  // w, degrees
constexpr double kFeatureExponent = 0.5; // q_f

using Plane = std::vector<float>;
using Kernel = std::vector<double>; ///< 2 r + 1 weights from -r to r

// Colour spaces. sRGB primaries and D65; the white point is XYZ of (1, 1, 1), so that greys have no
// chroma.
constexpr double kXyzFromRgb[3][3] = {{0.4123907993, 0.3575843394, 0.1804807884},
                                      {0.2126390059, 0.7151686788, 0.0721923154},
                                      {0.0193308187, 0.1191947798, 0.9505321522}};

double whiteXyz(int row) {
    return kXyzFromRgb[row][0] + kXyzFromRgb[row][1] + kXyzFromRgb[row][2];
}

/// Returns XYZ over the white point's.
glm::dvec3 relativeXyz(const glm::dvec3& rgb) {
    glm::dvec3 xyz;
    for (int r = 0; r < 3; ++r)
        xyz[r] =
            (kXyzFromRgb[r][0] * rgb.x + kXyzFromRgb[r][1] * rgb.y + kXyzFromRgb[r][2] * rgb.z) /
            whiteXyz(r);
    return xyz;
}

glm::dmat3 rgbFromRelativeXyz() {
    glm::dmat3 m; // column-major
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c)
            m[c][r] = kXyzFromRgb[r][c] / whiteXyz(r);
    return glm::inverse(m);
}

glm::dvec3 yCxCzFromXyz(const glm::dvec3& t) {
    return {116.0 * t.y - 16.0, 500.0 * (t.x - t.y), 200.0 * (t.y - t.z)};
}

glm::dvec3 xyzFromYCxCz(const glm::dvec3& c) {
    const double y = (c.x + 16.0) / 116.0;
    return {c.y / 500.0 + y, y, y - c.z / 200.0};
}

/// Returns CIELab with the Hunt adjustment of chroma (eq. 9): colours differ less in the dark.
glm::dvec3 huntLab(const glm::dvec3& xyz) {
    constexpr double kDelta = 6.0 / 29.0;
    const auto f = [](double t) {
        return t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3 * kDelta * kDelta) + 4.0 / 29.0;
    };
    const double x = f(xyz.x), y = f(xyz.y), z = f(xyz.z);
    const double lightness = 116.0 * y - 16.0;
    return {lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)};
}

/// Returns the HyAB distance: city block between lightness and chroma, Euclidean within chroma.
double hyab(const glm::dvec3& a, const glm::dvec3& b) {
    const glm::dvec3 d = a - b;
    return std::fabs(d.x) + std::sqrt(d.y * d.y + d.z * d.z);
}

/// Filters along x by kx and then along y by ky; borders repeat.
Plane convolve(const Plane& in, int width, int height, const Kernel& kx, const Kernel& ky) {
    Plane rows(in.size()), out(in.size());
    const int rx = int(kx.size() / 2), ry = int(ky.size() / 2);
    cpuParallelRanges(size_t(height), 8, [&](size_t begin, size_t end) {
        for (int y = int(begin); y < int(end); ++y) {
            const float* row = &in[size_t(y) * width];
            for (int x = 0; x < width; ++x) {
                double sum = 0;
                for (int i = -rx; i <= rx; ++i)
                    sum += kx[size_t(i + rx)] * row[std::clamp(x + i, 0, width - 1)];
                rows[size_t(y) * width + x] = float(sum);
            }
        }
    });
    cpuParallelRanges(size_t(height), 8, [&](size_t begin, size_t end) {
        std::vector<double> sum(static_cast<size_t>(width));
        for (int y = int(begin); y < int(end); ++y) {
            std::fill(sum.begin(), sum.end(), 0.0);
            for (int i = -ry; i <= ry; ++i) {
                const float* row = &rows[size_t(std::clamp(y + i, 0, height - 1)) * width];
                for (int x = 0; x < width; ++x)
                    sum[size_t(x)] += ky[size_t(i + ry)] * row[x];
            }
            for (int x = 0; x < width; ++x)
                out[size_t(y) * width + x] = float(sum[size_t(x)]);
        }
    });
    return out;
}

/// A Gaussian of a contrast sensitivity function in space (eq. 4): a sqrt(pi / b) exp(-pi^2 x^2 /
/// b), x in degrees.
struct SensitivityTerm {
    double a, b;
};

/// Returns a channel after the eye's spatial filter (eq. 5).
Plane filterChannel(const Plane& in, int width, int height,
                    const std::vector<SensitivityTerm>& terms) {
    constexpr double kWidestB = 0.04; // of all channels: one radius for all
    const int radius =
        int(std::ceil(3.0 * std::sqrt(kWidestB / (2.0 * kPi * kPi)) * kFlipPixelsPerDegree));
    std::vector<Kernel> kernels;
    double total = 0;
    for (const SensitivityTerm& term : terms) {
        Kernel kernel;
        double sum = 0;
        for (int i = -radius; i <= radius; ++i) {
            const double x = i / kFlipPixelsPerDegree;
            kernel.push_back(std::exp(-kPi * kPi * x * x / term.b));
            sum += kernel.back();
        }
        total += term.a * std::sqrt(kPi / term.b) * sum * sum;
        kernels.push_back(std::move(kernel));
    }
    Plane out(in.size(), 0.0f);
    for (size_t t = 0; t < terms.size(); ++t) {
        Kernel scaled = kernels[t];
        for (double& w : scaled)
            w *= terms[t].a * std::sqrt(kPi / terms[t].b) / total;
        const Plane part = convolve(in, width, height, kernels[t], scaled);
        for (size_t i = 0; i < out.size(); ++i)
            out[i] += part[i];
    }
    return out;
}

/// One image in the space in which FLIP filters.
struct OpponentImage {
    Plane channel[3]; ///< Y, Cx, Cz
};

OpponentImage toOpponent(const std::vector<glm::vec3>& display) {
    OpponentImage image;
    for (Plane& plane : image.channel)
        plane.resize(display.size());
    cpuParallelRanges(display.size(), 4096, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            glm::dvec3 linear;
            for (int c = 0; c < 3; ++c)
                linear[c] = linearFromSrgb(std::clamp(display[i][c], 0.0f, 1.0f));
            const glm::dvec3 opponent = yCxCzFromXyz(relativeXyz(linear));
            for (int c = 0; c < 3; ++c)
                image.channel[c][i] = float(opponent[c]);
        }
    });
    return image;
}

/// Returns the image as CIELab with Hunt adjustment after the eye's filter (sec. 4.1.1).
std::vector<glm::vec3> perceived(const OpponentImage& image, int width, int height) {
    const Plane y = filterChannel(image.channel[0], width, height, {{1.0, 0.0047}});
    const Plane cx = filterChannel(image.channel[1], width, height, {{1.0, 0.0053}});
    const Plane cz = filterChannel(image.channel[2], width, height, {{34.1, 0.04}, {13.5, 0.025}});
    const glm::dmat3 rgbFromXyz = rgbFromRelativeXyz();
    std::vector<glm::vec3> lab(y.size());
    cpuParallelRanges(lab.size(), 4096, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            const glm::dvec3 rgb = rgbFromXyz * xyzFromYCxCz({y[i], cx[i], cz[i]});
            lab[i] = glm::vec3(huntLab(relativeXyz(glm::clamp(rgb, 0.0, 1.0))));
        }
    });
    return lab;
}

/// Returns the colour difference in [0, 1] of a HyAB distance (eq. 10): the largest distance of
/// sRGB, green to blue, gives 1.
double compressColor(double distance, double largest) {
    const double error = std::pow(distance, kColorExponent);
    const double knee = kKneeShare * largest;
    return error < knee ? kKneeValue / knee * error
                        : kKneeValue + (error - knee) / (largest - knee) * (1.0 - kKneeValue);
}

/// Lengths of the responses to edges and to points of the achromatic channel (sec. 4.2).
struct Features {
    Plane edge, point;
};

Features detectFeatures(const Plane& achromatic, int width, int height) {
    const double sigma = 0.5 * kFeatureWidth * kFlipPixelsPerDegree;
    const int radius = int(std::ceil(3.0 * sigma));
    Kernel gauss, first, second;
    double gaussSum = 0, firstSum = 0, positiveSum = 0, negativeSum = 0;
    for (int i = -radius; i <= radius; ++i) {
        const double g = std::exp(-double(i) * i / (2.0 * sigma * sigma));
        gauss.push_back(g);
        first.push_back(-i * g);
        second.push_back((double(i) * i / (sigma * sigma) - 1.0) * g);
        gaussSum += g;
        firstSum += std::max(first.back(), 0.0);
        (second.back() > 0.0 ? positiveSum : negativeSum) += std::fabs(second.back());
    }
    // Positive weights sum to 1 and negative ones to -1 (of the two-dimensional kernels).
    for (double& w : gauss)
        w /= gaussSum;
    for (double& w : first)
        w /= firstSum;
    for (double& w : second)
        w /= w > 0.0 ? positiveSum : negativeSum;
    Plane normalised(achromatic.size());
    for (size_t i = 0; i < normalised.size(); ++i)
        normalised[i] = (achromatic[i] + 16.0f) / 116.0f;
    const auto length = [&](const Kernel& derivative) {
        Plane a = convolve(normalised, width, height, derivative, gauss);
        const Plane b = convolve(normalised, width, height, gauss, derivative);
        for (size_t i = 0; i < a.size(); ++i)
            a[i] = std::sqrt(a[i] * a[i] + b[i] * b[i]);
        return a;
    };
    return {length(first), length(second)};
}

} // namespace

double computeFlip(const std::vector<glm::vec3>& reference, const std::vector<glm::vec3>& test,
                   uint32_t width, uint32_t height, std::vector<float>* map) {
    const size_t count = size_t(width) * height;
    if (reference.size() != count || test.size() != count)
        throw Error(ErrorKind::kUsage, "FLIP needs two images of " + std::to_string(width) + " x " +
                                           std::to_string(height) + " pixels, got " +
                                           std::to_string(reference.size()) + " and " +
                                           std::to_string(test.size()) +
                                           " pixels; render both at one size");
    if (map)
        map->assign(count, 0.0f);
    if (count == 0)
        return 0.0;
    const int w = int(width), h = int(height);
    const OpponentImage a = toOpponent(reference), b = toOpponent(test);
    const std::vector<glm::vec3> labA = perceived(a, w, h), labB = perceived(b, w, h);
    const Features featuresA = detectFeatures(a.channel[0], w, h),
                   featuresB = detectFeatures(b.channel[0], w, h);
    const double largest =
        std::pow(hyab(huntLab(relativeXyz({0.0, 1.0, 0.0})), huntLab(relativeXyz({0.0, 0.0, 1.0}))),
                 kColorExponent);
    std::vector<float> difference(count);
    cpuParallelRanges(count, 4096, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            const double color = compressColor(hyab(labA[i], labB[i]), largest);
            const double feature =
                std::pow(std::max(std::fabs(featuresA.edge[i] - featuresB.edge[i]),
                                  std::fabs(featuresA.point[i] - featuresB.point[i])) /
                             std::sqrt(2.0),
                         kFeatureExponent);
            difference[i] = float(std::pow(color, 1.0 - feature)); // eq. 13
        }
    });
    double sum = 0;
    for (float d : difference)
        sum += d;
    if (map)
        *map = std::move(difference);
    return sum / double(count);
}

} // namespace shadowdag

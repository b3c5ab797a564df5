// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_observer.h"

#include "cuda/parallel_for.h"
#include "tools/window/view_overlay.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace shadowdag {

namespace {

/// Draws segments over a picture.
class LinePainter {
public:
    LinePainter(const ViewRays& view, std::vector<glm::vec3>& picture)
        : view_(view), picture_(picture) {}

    void line(const glm::dvec3& a, const glm::dvec3& b, const glm::vec3& color) {
        const auto ends = pixelsOfSegment(view_, a, b);
        if (!ends)
            return;
        const glm::dvec3 p = ends->first, q = ends->second;
        const double length = std::max(std::abs(q.x - p.x), std::abs(q.y - p.y));
        // Ends far beyond the picture would take very long, and only few pixels of them are
        // visible.
        const int steps = int(std::min(length, 8.0 * double(view_.width + view_.height)));
        for (int i = 0; i <= steps; ++i) {
            const double t = steps > 0 ? double(i) / double(steps) : 0.0;
            const double x = p.x + (q.x - p.x) * t, y = p.y + (q.y - p.y) * t;
            if (x >= -0.5 && y >= -0.5 && x < double(view_.width) - 0.5 &&
                y < double(view_.height) - 0.5)
                picture_[size_t(std::lround(y)) * view_.width + size_t(std::lround(x))] = color;
        }
    }

    void box(const Box& box, const glm::vec3& color) {
        if (box.empty())
            return;
        for (const auto& [a, b] : edgesOf(box))
            line(a, b, color);
    }

private:
    const ViewRays& view_;
    std::vector<glm::vec3>& picture_;
};

} // namespace

glm::dvec3 pixelOfPoint(const ViewRays& view, const glm::dvec3& pointWorld) {
    const glm::dvec3 d = pointWorld - view.origin;
    const double depth = glm::dot(d, view.forward);
    return {(glm::dot(d, view.right) / depth - view.firstX) / view.pixelSize,
            (view.firstY - glm::dot(d, view.up) / depth) / view.pixelSize, depth};
}

std::optional<std::pair<glm::dvec3, glm::dvec3>> pixelsOfSegment(const ViewRays& view, glm::dvec3 a,
                                                                 glm::dvec3 b) {
    const double da = glm::dot(a - view.origin, view.forward) - view.znear;
    const double db = glm::dot(b - view.origin, view.forward) - view.znear;
    if (da < 0.0 && db < 0.0)
        return std::nullopt;
    if (da < 0.0)
        a += (b - a) * (da / (da - db));
    else if (db < 0.0)
        b += (a - b) * (db / (db - da));
    return std::pair(pixelOfPoint(view, a), pixelOfPoint(view, b));
}

std::array<std::pair<glm::dvec3, glm::dvec3>, 12> edgesOf(const Box& box) {
    const auto corner = [&](int i) {
        return glm::dvec3((i & 1) ? box.max.x : box.min.x, (i & 2) ? box.max.y : box.min.y,
                          (i & 4) ? box.max.z : box.min.z);
    };
    std::array<std::pair<glm::dvec3, glm::dvec3>, 12> edges;
    size_t count = 0;
    for (int i = 0; i < 8; ++i)
        for (int bit = 1; bit < 8; bit *= 2)
            if (!(i & bit))
                edges[count++] = {corner(i), corner(i | bit)};
    return edges;
}

std::vector<glm::vec3> drawObserved(const GBufferView& observed, const Camera& observer,
                                    const GBufferView& frozen, const Camera& frozenCamera,
                                    const std::vector<glm::vec3>& frozenDisplay,
                                    View<const Box> boxesWorld) {
    const ViewRays view = makeViewRays(observer, observed.width, observed.height);
    const ViewRays seen = makeViewRays(frozenCamera, frozen.width, frozen.height);
    std::vector<glm::vec3> picture(observed.count(), glm::vec3(0.0f));
    cpuParallelRanges(picture.size(), 1024, [&](size_t begin, size_t end) {
        for (size_t s = begin; s < end; ++s) {
            if (observed.triangle[s] == kBackground)
                continue;
            const glm::dvec3 position(observed.positionWorld[s]);
            const double facing = std::abs(glm::dot(glm::normalize(position - view.origin),
                                                    glm::dvec3(observed.normalWorld[s])));
            picture[s] = glm::vec3(float(0.10 + 0.18 * facing));
            const glm::dvec3 at = pixelOfPoint(seen, position);
            if (!(at.z > 0.0) || at.x < -0.5 || at.y < -0.5 || at.x >= double(seen.width) - 0.5 ||
                at.y >= double(seen.height) - 0.5)
                continue;
            const size_t other = size_t(std::lround(at.y)) * seen.width + size_t(std::lround(at.x));
            // The same surface: the same distance, within the steps of depth over two pixels.
            const double slack = at.z * (4.0 * seen.pixelSize + 0.01);
            if (frozen.triangle[other] == observed.triangle[s] ||
                (frozen.triangle[other] != kBackground &&
                 std::abs(double(frozen.depthView[other]) - at.z) < slack))
                picture[s] = frozenDisplay[other];
        }
    });
    LinePainter painter(view, picture);
    for (size_t i = 0; i < boxesWorld.count; ++i)
        painter.box(boxesWorld[i], glm::mix(hashColor(uint32_t(i)), glm::vec3(1.0f), 0.2f));
    // The frustum up to the frame's farthest sample.
    double far = 1.0;
    for (size_t s = 0; s < frozen.count(); ++s)
        far = std::max(far, double(frozen.depthView[s]));
    const std::array<glm::dvec3, 4> ways{seen.direction(0, 0), seen.direction(seen.width - 1, 0),
                                         seen.direction(seen.width - 1, seen.height - 1),
                                         seen.direction(0, seen.height - 1)};
    const glm::vec3 white(0.95f);
    for (size_t i = 0; i < ways.size(); ++i) {
        const glm::dvec3& way = ways[i];
        painter.line(seen.origin, seen.origin + way * far, white);
        painter.line(seen.origin + way * far, seen.origin + ways[(i + 1) % 4] * far, white);
    }
    return picture;
}

} // namespace shadowdag

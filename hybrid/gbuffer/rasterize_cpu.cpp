// SPDX-License-Identifier: Apache-2.0
// The CPU's own kernel of gbuffer_raster.h: batches front to back; four triangles are set up at
// once, and four pixels of a row are covered at once, by the same operations in the same order, so
// that the visibility buffer has the same bits. Only the rectangle of pixels that may see a
// triangle is computed otherwise; its margin is far more than the difference. What a lane cannot
// handle uses the shared code. Batches whose box lies behind what all its pixels see are left out:
// they could not change a pixel.
#include "hybrid/gbuffer/rasterize_cpu.h"

#include "cuda/backend.h"
#include "cuda/mutant.h"
#include "cuda/parallel_for.h"
#include "scenes/double_lanes.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <vector>

namespace shadowdag {

namespace {

/// A batch that may be seen.
struct SeenBatch {
    float nearest; ///< no depth of its triangles, by SeenTriangle::depthAt, is less
    uint32_t batch;
};

/// Returns the batches that may be seen, the nearest first: what they hide is then not written.
std::vector<SeenBatch> seenBatches(const BatchesInView& work) {
    std::vector<SeenBatch> seen(work.batches.count);
    parallelFor<CpuTag>(
        seen.size(),
        [&](size_t b) {
            const Box& box = work.batchBoxes[b];
            const glm::dvec3 center = (glm::dvec3(box.min) + glm::dvec3(box.max)) * 0.5,
                             half = (glm::dvec3(box.max) - glm::dvec3(box.min)) * 0.5;
            const double nearest = glm::dot(work.view.forward, center - work.view.origin) -
                                   glm::dot(glm::abs(work.view.forward), half);
            // Corners' depths are rounded to 2^-52 of these coordinates, and to floats.
            const glm::dvec3 largest = glm::abs(center) + half + glm::abs(work.view.origin);
            const double below =
                nearest - 0x1p-40 * glm::max(largest.x, glm::max(largest.y, largest.z));
            seen[b] = {mayBeSeen(box, work.view) ? float(below - 0x1p-20 * glm::abs(below)) : 3e38f,
                       uint32_t(b)};
        },
        256);
    std::erase_if(seen, [](const SeenBatch& batch) { return !(batch.nearest < 3e38f); });
    std::sort(seen.begin(), seen.end(), [](const SeenBatch& a, const SeenBatch& b) {
        return a.nearest != b.nearest ? a.nearest < b.nearest : a.batch < b.batch;
    });
    return seen;
}

#if defined(SDAG_DOUBLE_LANES)

using namespace avx2;

/// SeenTriangle, four of them.
struct alignas(32) SeenTriangles {
    double start[4][4], perX[4][4], perY[4][4];
    double plane[4];
    float nearest[4];
    int32_t minX[4], minY[4], maxX[4], maxY[4];

    SeenTriangle at(int lane, uint32_t triangle) const {
        SeenTriangle t;
        for (int k = 0; k < 4; ++k) {
            t.start[k] = start[k][lane];
            t.perX[k] = perX[k][lane];
            t.perY[k] = perY[k][lane];
        }
        t.plane = plane[lane];
        t.triangle = triangle;
        t.rect = {minX[lane], minY[lane], maxX[lane], maxY[lane]};
        t.nearest = nearest[lane];
        return t;
    }
};

/// boundPixels along one axis, of triangles in front of the near plane. Returns the lanes that may
/// have a pixel. @param lo,hi bounds in pixels
inline Lanes pixelSpans(Lanes lo, Lanes hi, double lastPixel, int32_t* first, int32_t* last) {
    const Lanes margin = all(0.01);
    return wholeSpans(lo - margin, hi + margin, all(lastPixel), first, last);
}

/// setUpSeen in lanes. Returns the lanes (bit i = lane i) that may be seen and are set up in `t`;
/// those in `crossing` reach the near plane and are left to setUpSeen.
/// @param wanted lanes that hold a triangle
inline uint32_t setUpSeenLanes(const TriangleView& triangles, const uint32_t* four,
                               const ViewRays& view, uint32_t wanted, uint32_t& crossing,
                               SeenTriangles& t) {
    const Lanes3 origin = all(view.origin), right = all(view.right), up = all(view.up),
                 forward = all(view.forward);
    Lanes3 corner[3];
    Lanes z[3];
    for (int i = 0; i < 3; ++i) {
        corner[i] = difference(vertices(triangles, four, i), origin);
        z[i] = dot(corner[i], forward);
    }
    const Lanes znear = all(view.znear);
    const Lanes inFront[3] = {atLeast(z[0], znear), atLeast(z[1], znear), atLeast(z[2], znear)};
    const uint32_t any = bitsOf(_mm256_or_pd(inFront[0], _mm256_or_pd(inFront[1], inFront[2]))),
                   whole = bitsOf(_mm256_and_pd(inFront[0], _mm256_and_pd(inFront[1], inFront[2])));
    crossing = wanted & any & ~whole;
    uint32_t kept = wanted & whole;
    if (!kept)
        return 0;
    Lanes x[3], y[3];
    for (int i = 0; i < 3; ++i) {
        const Lanes perZ = all(1.0) / z[i];
        x[i] = dot(corner[i], right) * perZ;
        y[i] = dot(corner[i], up) * perZ;
    }
    const Lanes scale = all(1.0 / view.pixelSize);
    kept &= bitsOf(pixelSpans((least(x[0], least(x[1], x[2])) - all(view.firstX)) * scale,
                              (most(x[0], most(x[1], x[2])) - all(view.firstX)) * scale,
                              double(view.width) - 1.0, t.minX, t.maxX));
    kept &= bitsOf(pixelSpans((all(view.firstY) - most(y[0], most(y[1], y[2]))) * scale,
                              (all(view.firstY) - least(y[0], least(y[1], y[2]))) * scale,
                              double(view.height) - 1.0, t.minY, t.maxY));
    if (!kept)
        return 0;
    const Lanes3 a = difference(corner[1], corner[0]), b = difference(corner[2], corner[0]);
    const Lanes3 normal = cross(a, b);
    kept &= bitsOf(above(dot(normal, normal), all(kParallelSides) * dot(a, a) * dot(b, b)));
    if (!kept)
        return 0;
    const Lanes3 first = all(view.first), stepX = all(view.stepX), stepY = all(view.stepY);
    for (int i = 0; i < 4; ++i) {
        const Lanes3 n = i == 3 ? normal : cross(corner[i], corner[i == 2 ? 0 : i + 1]);
        _mm256_store_pd(t.start[i], dot(n, first));
        _mm256_store_pd(t.perX[i], dot(n, stepX));
        _mm256_store_pd(t.perY[i], dot(n, stepY));
    }
    _mm256_store_pd(t.plane, dot(normal, corner[0]));
    _mm_store_ps(t.nearest, _mm256_cvtpd_ps(least(z[0], least(z[1], z[2]))));
    return kept;
}

/// Returns in `first` and `last` the pixels of a row outside of which there are none inside. An
/// edge function is monotone along the row as it is rounded, so its values at the ends of a part
/// bound those between them: a part where one edge is negative and another positive is outside, as
/// in isOutside. Quotients estimate where the parts end. @param perPerX inverses of seen.perX
inline void narrowRow(const SeenTriangle& seen, const double* row, const double* perPerX,
                      int& first, int& last) {
    const double side = seen.plane > 0.0 ? 1.0 : -1.0; // of the edges inside, but for rounding
    const auto edge = [&](int i, int x) { return side * (row[i] + double(x) * seen.perX[i]); };
    const auto isOut = [&](int i, int from, int to) {
        const auto isIn = [&](int other) {
            return edge(other, from) > 0.0 && edge(other, to) > 0.0;
        };
        return edge(i, from) < 0.0 && edge(i, to) < 0.0 && (isIn((i + 1) % 3) || isIn((i + 2) % 3));
    };
    for (int i = 0; i < 3; ++i) {
        const double at = -row[i] * perPerX[i]; // not a number or infinite: no bound
        if (!(at > double(first) && at < double(last)))
            continue;
        const int bound = int(at);
        if (side * seen.perX[i] > 0.0) { // inside to the right
            if (bound > first && isOut(i, first, bound - 1))
                first = bound;
        } else if (bound + 1 < last && isOut(i, bound + 2, last)) {
            last = bound + 1;
        }
    }
}

/// coverPixels in lanes, of a triangle without a mask.
/// @tparam isShared other threads draw into the same visibility buffer
template <bool isShared>
inline void coverPixelsLanes(const SeenTriangle& seen, const ViewRays& view,
                             View<uint64_t> visibility) {
    const PixelRect& rect = seen.rect;
    const Lanes zero = _mm256_setzero_pd(), znear = all(view.znear), zfar = all(view.zfar),
                plane = all(seen.plane), nearest = all(double(seen.nearest));
    const Lanes perX[4] = {all(seen.perX[0]), all(seen.perX[1]), all(seen.perX[2]),
                           all(seen.perX[3])};
    constexpr int kNarrow = 8; // pixels, along which it takes less to test them all
    const bool isWide = rect.maxX - rect.minX >= kNarrow;
    const double perPerX[3] = {1.0 / seen.perX[0], 1.0 / seen.perX[1], 1.0 / seen.perX[2]};
    for (int y = rect.minY; y <= rect.maxY; ++y) {
        double row[4];
        for (int i = 0; i < 4; ++i)
            row[i] = seen.start[i] + double(y) * seen.perY[i];
        int first = rect.minX, last = rect.maxX;
        if (isWide)
            narrowRow(seen, row, perPerX, first, last);
        uint64_t* const pixels = &visibility[size_t(y) * view.width];
        for (int x = first; x <= last; x += 4) {
            const Lanes X = all(double(x)) + _mm256_setr_pd(0, 1, 2, 3);
            const Lanes e[3] = {all(row[0]) + X * perX[0], all(row[1]) + X * perX[1],
                                all(row[2]) + X * perX[2]};
            const auto allOf = [](Lanes a, Lanes b, Lanes c) {
                return _mm256_and_pd(a, _mm256_and_pd(b, c));
            };
            uint32_t covered = bitsOf(
                _mm256_or_pd(allOf(atLeast(e[0], zero), atLeast(e[1], zero), atLeast(e[2], zero)),
                             allOf(atLeast(zero, e[0]), atLeast(zero, e[1]), atLeast(zero, e[2]))));
            if (last - x < 3)
                covered &= (1u << (last - x + 1)) - 1u;
            if (!covered)
                continue;
            const Lanes depth = most(plane / (all(row[3]) + X * perX[3]), nearest);
            covered &= bitsOf(_mm256_and_pd(atLeast(depth, znear), atLeast(zfar, depth)));
            const __m128i depths = _mm_castps_si128(_mm256_cvtpd_ps(depth));
            if constexpr (isShared) {
                alignas(16) uint32_t bits[4];
                _mm_store_si128(reinterpret_cast<__m128i*>(bits), depths);
                for (; covered; covered &= covered - 1) {
                    const int lane = __builtin_ctz(covered);
                    atomicMinRelaxed(&pixels[x + lane], uint64_t(bits[lane]) << 32 | seen.triangle);
                }
            } else {
                const __m256i lanes = _mm256_setr_epi64x(1, 2, 4, 8),
                              mask = _mm256_cmpeq_epi64(
                                  _mm256_and_si256(_mm256_set1_epi64x(covered), lanes), lanes),
                              sign = _mm256_set1_epi64x(INT64_MIN);
                const __m256i now =
                    _mm256_or_si256(_mm256_slli_epi64(_mm256_cvtepu32_epi64(depths), 32),
                                    _mm256_set1_epi64x(seen.triangle));
                auto* const stored = reinterpret_cast<long long*>(pixels + x);
                const __m256i before = _mm256_maskload_epi64(stored, mask);
                const __m256i isNearer =
                    _mm256_and_si256(mask, _mm256_cmpgt_epi64(_mm256_xor_si256(before, sign),
                                                              _mm256_xor_si256(now, sign)));
                if (_mm256_movemask_pd(_mm256_castsi256_pd(isNearer)))
                    _mm256_maskstore_epi64(stored, isNearer, now);
            }
        }
    }
}

template <bool isShared> void drawTriangle(const BatchesInView& work, const SeenTriangle& seen) {
    if (work.triangles.masks.isCut(seen.triangle))
        coverPixels(work.triangles, seen, seen.rect, work.view, work.visibility);
    else
        coverPixelsLanes<isShared>(seen, work.view, work.visibility);
}

/// @param next the batch that is drawn after this one, or this one
template <bool isShared>
void drawBatch(const BatchesInView& work, const Batch& batch, const Batch& next) {
    const uint32_t* const triangles = &work.batchTriangles[batch.first];
    const RequestedFours fours(work.triangles, triangles, batch.count,
                               &work.batchTriangles[next.first], next.count);
    for (uint32_t first = 0; first < batch.count; first += 4) {
        const uint32_t count = fours.take(first);
        uint32_t four[4];
        for (uint32_t lane = 0; lane < 4; ++lane)
            four[lane] = triangles[first + std::min(lane, count - 1)];
        SeenTriangles t;
        uint32_t crossing = 0;
        uint32_t ready =
            setUpSeenLanes(work.triangles, four, work.view, (1u << count) - 1u, crossing, t);
        for (; ready; ready &= ready - 1) {
            const int lane = __builtin_ctz(ready);
            drawTriangle<isShared>(work, t.at(lane, four[lane]));
        }
        for (; crossing; crossing &= crossing - 1) {
            SeenTriangle seen;
            const uint32_t triangle = four[__builtin_ctz(crossing)];
            if (setUpSeen(work.triangles, triangle, work.view, seen))
                drawTriangle<isShared>(work, seen);
        }
    }
}

/// The farthest depth that the pixels of every tile see so far.
class SeenDepths {
public:
    explicit SeenDepths(const ViewRays& view)
        : view_(view), across_(tilesOf(view.width)),
          farthest_(size_t(across_) * tilesOf(view.height)) {}

    /// Reads the visibility buffers, of which a pixel sees the nearest.
    void update(const std::vector<View<const uint64_t>>& buffers) {
        parallelFor<CpuTag>(
            tilesOf(view_.height),
            [&](size_t row) {
                const uint32_t end = std::min(uint32_t(row + 1) * kTile, view_.height);
                uint32_t* const tiles = &farthest_[row * across_];
                std::fill_n(tiles, across_, 0u);
                for (uint32_t y = uint32_t(row) * kTile; y < end; ++y)
                    for (uint32_t x = 0; x < view_.width; x += kTile)
                        addTile(buffers, size_t(y) * view_.width + x,
                                std::min(kTile, view_.width - x), tiles[x / kTile]);
            },
            1);
    }

    /// Returns whether nothing of a batch can be seen: at every pixel that may see its box,
    /// something nearer is.
    bool hide(const SeenBatch& batch, const Box& box) const {
        if (!(double(batch.nearest) > view_.znear))
            return false;
        double minX = 1e30, minY = 1e30, maxX = -1e30, maxY = -1e30;
        for (int c = 0; c < 8; ++c) {
            const glm::vec3 corner(c & 1 ? box.max.x : box.min.x, c & 2 ? box.max.y : box.min.y,
                                   c & 4 ? box.max.z : box.min.z);
            const glm::dvec3 p = glm::dvec3(corner) - view_.origin;
            const double perZ = 1.0 / glm::dot(p, view_.forward);
            const double x = glm::dot(p, view_.right) * perZ, y = glm::dot(p, view_.up) * perZ;
            minX = std::min(minX, x);
            maxX = std::max(maxX, x);
            minY = std::min(minY, y);
            maxY = std::max(maxY, y);
        }
        const double scale = 1.0 / view_.pixelSize;
        const auto tile = [&](double pixel, uint32_t count) {
            return uint32_t(glm::clamp(pixel, 0.0, double(count - 1))) / kTile;
        };
        // A pixel more than boundPixels would give.
        const uint32_t x0 = tile((minX - view_.firstX) * scale - 1.0, view_.width),
                       x1 = tile((maxX - view_.firstX) * scale + 1.0, view_.width),
                       y0 = tile((view_.firstY - maxY) * scale - 1.0, view_.height),
                       y1 = tile((view_.firstY - minY) * scale + 1.0, view_.height);
        const uint32_t nearest = std::bit_cast<uint32_t>(batch.nearest);
        for (uint32_t y = y0; y <= y1; ++y)
            for (uint32_t x = x0; x <= x1; ++x)
                if (farthest_[size_t(y) * across_ + x] >= nearest)
                    return false;
        return true;
    }

private:
    static constexpr uint32_t kTile = 8; ///< pixels along a side

    static uint32_t tilesOf(uint32_t pixels) { return (pixels + kTile - 1) / kTile; }
    static void addTile(const std::vector<View<const uint64_t>>& buffers, size_t first,
                        uint32_t count, uint32_t& farthest) {
        uint32_t nearest[kTile];
        for (uint32_t i = 0; i < count; ++i)
            nearest[i] = uint32_t(buffers[0].data[first + i] >> 32);
        for (size_t b = 1; b < buffers.size(); ++b)
            for (uint32_t i = 0; i < count; ++i)
                nearest[i] = std::min(nearest[i], uint32_t(buffers[b].data[first + i] >> 32));
        for (uint32_t i = 0; i < count; ++i)
            farthest = std::max(farthest, nearest[i]);
    }

    const ViewRays& view_;
    uint32_t across_;
    std::vector<uint32_t> farthest_; ///< bits of depths, by tile
};

/// Draws batches in rounds, each without those that the rounds before hide. What is left out does
/// not depend on threads.
/// @param buffers that draw() writes @param draw(begin, end) the batches of `seen` with isHidden 0
template <class Draw>
void drawInRounds(const BatchesInView& work, const std::vector<SeenBatch>& seen,
                  const std::vector<View<const uint64_t>>& buffers, std::vector<uint8_t>& isHidden,
                  const Draw& draw) {
    constexpr size_t kFirst = 256, kMost = 4096; // batches a round, between two polls
    constexpr size_t kLeastHidden = 16; // one of so many; where it is less, depths take longer
    isHidden.assign(seen.size(), 0);
    SeenDepths depths(work.view);
    bool doesHide = true;
    for (size_t begin = 0; begin < seen.size();) {
        const size_t end = std::min(begin + std::clamp(begin, kFirst, kMost), seen.size());
        if (begin > 0 && doesHide) {
            depths.update(buffers);
            parallelFor<CpuTag>(
                end - begin,
                [&](size_t i) {
                    const SeenBatch& batch = seen[begin + i];
                    isHidden[begin + i] = depths.hide(batch, work.batchBoxes[batch.batch]);
                },
                64);
            doesHide = size_t(std::count(isHidden.begin() + ptrdiff_t(begin),
                                         isHidden.begin() + ptrdiff_t(end), 1)) *
                           kLeastHidden >=
                       end - begin;
        }
        for (size_t i = begin; i < end; ++i)
            if (seen[i].batch % 8 == 7 && isMutant(Mutant::kSeenBatchLost))
                isHidden[i] = 1;
        draw(begin, end);
        begin = end;
    }
}

/// Draws with one visibility buffer a thread, which needs no atomics, and merges them.
/// @param parts of all threads but the first, which draws into work.visibility
void drawInParts(const BatchesInView& work, const std::vector<SeenBatch>& seen, size_t partCount,
                 Buffer<uint64_t>& parts) {
    const View<uint64_t> all = work.visibility;
    parts.resize((partCount - 1) * all.count);
    parts.fill(0xff); // kNothingSeen
    const auto visibilityOf = [&](size_t part) {
        return part == 0 ? all : View<uint64_t>{&parts.view()[(part - 1) * all.count], all.count};
    };
    std::vector<View<const uint64_t>> buffers;
    for (size_t part = 0; part < partCount; ++part)
        buffers.push_back({visibilityOf(part).data, all.count});
    constexpr size_t kTaken = 8; // batches at a time
    std::vector<uint8_t> isHidden;
    drawInRounds(work, seen, buffers, isHidden, [&](size_t begin, size_t end) {
        std::atomic<size_t> taken{begin};
        parallelFor<CpuTag>(
            partCount,
            [&](size_t part) {
                BatchesInView own = work;
                own.visibility = visibilityOf(part);
                for (size_t first; (first = taken.fetch_add(kTaken)) < end;)
                    for (size_t i = first; i < std::min(first + kTaken, end); ++i)
                        if (!isHidden[i])
                            drawBatch<false>(own, work.batches[seen[i].batch],
                                             work.batches[seen[std::min(i + 1, end - 1)].batch]);
            },
            1);
    });
    if (partCount > 1)
        parallelFor<CpuTag>(
            all.count,
            [&](size_t i) {
                for (size_t part = 1; part < partCount; ++part)
                    all[i] = std::min(all[i], visibilityOf(part)[i]);
            },
            4096);
}

void drawBatches(const BatchesInView& work, const std::vector<SeenBatch>& seen,
                 Buffer<uint64_t>& parts) {
    constexpr size_t kMostParts = 4; // more would take longer to clear and to merge
    constexpr size_t kMostBytes = size_t(256) << 20;
    const size_t threads = size_t(threadCount());
    if (threads <= kMostParts &&
        (threads - 1) * work.visibility.count * sizeof(uint64_t) <= kMostBytes) {
        drawInParts(work, seen, threads, parts);
        return;
    }
    std::vector<uint8_t> isHidden;
    drawInRounds(work, seen, {{work.visibility.data, work.visibility.count}}, isHidden,
                 [&](size_t begin, size_t end) {
                     parallelFor<CpuTag>(
                         end - begin,
                         [&](size_t k) {
                             const size_t i = begin + k, next = std::min(i + 1, end - 1);
                             if (!isHidden[i])
                                 drawBatch<true>(work, work.batches[seen[i].batch],
                                                 work.batches[seen[next].batch]);
                         },
                         8);
                 });
}

#else

void drawBatches(const BatchesInView& work, const std::vector<SeenBatch>& seen, Buffer<uint64_t>&) {
    parallelFor<CpuTag>(
        seen.size(),
        [&](size_t i) {
            const Batch& batch = work.batches[seen[i].batch];
            for (uint32_t t = batch.first; t < batch.first + batch.count; ++t)
                rasterizeTriangle(work.triangles, work.batchTriangles[t], work.view,
                                  work.visibility);
        },
        8);
}

#endif

} // namespace

void rasterizeFrontToBack(const BatchesInView& work, Buffer<uint64_t>& parts) {
    drawBatches(work, seenBatches(work), parts);
}

} // namespace shadowdag

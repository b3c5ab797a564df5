// SPDX-License-Identifier: Apache-2.0
// Beams: rays by what is kept of a cell and a light have the answers of a test of every triangle,
// and frames with beams are those without, while view, lights and geometry move and memory is
// short.
#include "hybrid/rays/beams.h"

#include "cuda/backend.h"
#include "cuda/error.h"
#include "hybrid/frame.h"
#include "hybrid/rays/beam_rays.h"
#include "scenes/builtin.h"
#include "tests/hybrid/fail_stage.h"
#include "tests/hybrid/rays/exact_stage.h"

#include <gtest/gtest.h>

#include <cmath>

namespace shadowdag::test {
namespace {

constexpr uint64_t kBeamSeed = 20261127;
constexpr uint64_t kBytes = uint64_t(16) << 20;

std::vector<StreamIsa> isas() {
    std::vector<StreamIsa> all;
    for (const StreamIsa isa : {StreamIsa::kPortable, StreamIsa::kAvx2, StreamIsa::kAvx512})
        if (hasStreamIsa(isa))
            all.push_back(isa);
    return all;
}

Light pointLight(const glm::vec3& at) {
    Light light;
    light.positionWorld = at;
    light.rangeWorld = 1e6f;
    return light;
}

/// Samples on triangles, on the side of a light.
struct Samples {
    std::vector<glm::vec3> positionWorld, normalWorld;
    std::vector<uint32_t> triangle;

    void add(const ExactStage& stage, uint32_t of, const glm::vec3& weights, const Light& light) {
        const TriangleView& t = stage.geometry.triangles;
        const glm::vec3 p =
            weights.x * t.vertex(of, 0) + weights.y * t.vertex(of, 1) + weights.z * t.vertex(of, 2);
        const glm::vec3 normal = stage.normalOf(of);
        if (!(glm::length(normal) > 0.0f))
            return;
        positionWorld.push_back(p);
        normalWorld.push_back(
            glm::normalize(glm::dot(normal, light.positionWorld - p) < 0.0f ? -normal : normal));
        triangle.push_back(of);
    }
    size_t count() const { return positionWorld.size(); }
};

struct BeamOutcome {
    uint64_t rayCount = 0, openCount = 0, blockedCount = 0, wrongCount = 0;
};

/// Asks the beams for all samples; those that are open are not counted.
BeamOutcome ask(const ExactStage& stage, const Samples& samples, const Light& light,
                double footprint, BeamCache& cache, StreamIsa isa) {
    const ExactView exact{stage.geometry, stage.bvh.view()};
    BeamRays rays(exact, cache, isa);
    std::vector<uint32_t> all(samples.count()), sorted;
    std::iota(all.begin(), all.end(), 0u);
    rays.setCluster(viewOf(samples.positionWorld), viewOf(samples.normalWorld), viewOf(all),
                    footprint, sorted);
    std::vector<uint32_t> seen = sorted;
    std::sort(seen.begin(), seen.end());
    EXPECT_EQ(seen, all);
    std::vector<TruthStart> starts;
    for (const uint32_t s : sorted)
        starts.push_back(makeTruthStart(stage.geometry,
                                        makeTruthTriangle(stage.geometry, samples.triangle[s]),
                                        samples.positionWorld[s], samples.normalWorld[s]));
    rays.setStarts(viewOf(starts));
    std::vector<uint8_t> isAsked((samples.count() + 15) / 16 * 16, 0);
    for (size_t i = 0; i < samples.count(); ++i)
        isAsked[i] = i % 7 != 3;
    std::vector<uint8_t> isDark(samples.count(), 7), isOpen(samples.count());
    BeamOutcome outcome;
    outcome.openCount = rays.answer(0, light, isAsked.data(), viewOf(isDark));
    rays.listOpen(viewOf(isOpen));
    uint64_t listed = 0;
    for (size_t i = 0; i < samples.count(); ++i) {
        EXPECT_LE(isOpen[i], isAsked[i]);
        listed += isOpen[i];
        if (!isAsked[i] || isOpen[i])
            continue;
        const TruthRay ray = truthRay(starts[i].plane, starts[i].startLocal,
                                      glm::dvec3(light.positionWorld) - stage.geometry.origin);
        bool isBlocked = false;
        for (const uint32_t other : stage.all)
            isBlocked =
                isBlocked || (ray.tFar > 0.0f && blocksTruthRay(stage.geometry, ray, other));
        ++outcome.rayCount;
        outcome.blockedCount += isBlocked;
        outcome.wrongCount += isDark[i] != uint8_t(isBlocked);
    }
    EXPECT_EQ(listed, outcome.openCount);
    return outcome;
}

TEST(Beams, AnswerAsATestOfEveryTriangle) {
    RecordProperty("seed", std::to_string(kBeamSeed));
    for (const StreamIsa isa : isas()) {
        SCOPED_TRACE(streamIsaName(isa));
        Random random(kBeamSeed);
        BeamOutcome all;
        for (const glm::vec3 around :
             {glm::vec3(0), glm::vec3(3, 0, -2), glm::vec3(1e5f, -2e5f, 3e4f)}) {
            ExactStage stage;
            addClump(stage, random, around);
            stage.build();
            for (int repeat = 0; repeat < 12; ++repeat) {
                const double cell = std::exp2(-double(repeat % 6));
                Light light = pointLight(around + random.inCube(repeat % 2 ? 1.0 : 5.0));
                if (repeat == 0) // on a triangle
                    light.positionWorld = stage.geometry.triangles.vertex(7, 1);
                BeamCache cache(isa);
                // A patch of a few triangles, so that cells hold many starts.
                Samples samples;
                const uint32_t first = random.below(stage.all.size() - 8);
                while (samples.count() < 500)
                    samples.add(stage, first + random.below(8), insideWeights(random), light);
                for (int frame = 0; frame < 4; ++frame) { // made, kept, divided
                    cache.begin(stage.bvh.view(), stage.geometry, {&light, 1}, kBytes,
                                BeamCache::kMakeAll);
                    const BeamOutcome one = ask(stage, samples, light, cell / 8.0, cache, isa);
                    EXPECT_EQ(one.wrongCount, 0u) << "frame " << frame << ", cell " << cell;
                    all.rayCount += one.rayCount;
                    all.openCount += one.openCount;
                    all.blockedCount += one.blockedCount;
                }
            }
        }
        EXPECT_GT(all.rayCount, 40000u);
        EXPECT_GT(all.rayCount, all.openCount);
        EXPECT_GT(all.blockedCount, all.rayCount / 20);
        EXPECT_LT(all.blockedCount, all.rayCount / 20 * 19);
    }
}

/// A floor of 8 x 8 m at y = 0 and a plate of 2 x 2 m at y = 2, under a light at y = 4: the plate's
/// shadow is |x|, |z| < 2.
struct Umbra {
    ExactStage stage;
    Light light = pointLight({0, 4, 0});

    Umbra() {
        stage.soup.addLevelSquare({0, 0, 0}, 4);
        stage.soup.addLevelSquare({0, 2, 0}, 1);
        stage.build();
    }
    /// @param receiver triangle of the floor
    BeamKind kindOf(BeamCache& cache, const glm::vec3& low, const glm::vec3& high, uint64_t key,
                    uint32_t rayCount = 1) const {
        const glm::vec3 origin(stage.geometry.origin);
        const Box box{low - origin, high - origin};
        BeamPlanes none;
        none.count = BeamPlanes::kMax + 1;
        BeamCache::Cell* cell = cache.cellOf(key, box, none, 0.25f);
        BeamTally tally;
        const BeamKind kind =
            cache.find(cell, 0, light.positionWorld - origin, rayCount, tally).kind;
        cache.add(tally);
        return kind;
    }
};

TEST(Beams, OfAPlateAreLitDarkOrListedWhereItsUmbraSays) {
    const Umbra umbra;
    for (const StreamIsa isa : isas()) {
        SCOPED_TRACE(streamIsaName(isa));
        BeamCache cache(isa);
        cache.begin(umbra.stage.bvh.view(), umbra.stage.geometry, {&umbra.light, 1}, kBytes,
                    BeamCache::kMakeAll);
        uint64_t key = 0, dark = 0, lit = 0, listed = 0;
        for (float x = -3.9f; x < 3.9f; x += 0.25f)
            for (float z = -3.9f; z < 3.9f; z += 0.25f) {
                const glm::vec3 low(x, 0.01f, z), high(x + 0.2f, 0.01f, z + 0.2f);
                const BeamKind kind = umbra.kindOf(cache, low, high, ++key);
                // A start at height h is in the shadow where |x| < (4 - h) / 2. Boxes are rounded
                // to an eighth of the cell.
                const float edge = 0.5f * (4.0f - 0.01f), round = 0.125f * 0.25f;
                const auto isInside = [&](float from, float to) {
                    return from - round > -edge && to + round < edge;
                };
                const auto isOutside = [&](float from, float to) {
                    return from - round > edge || to + round < -edge;
                };
                if (isOutside(low.x, high.x) || isOutside(low.z, high.z)) {
                    EXPECT_EQ(kind, BeamKind::kLit) << x << ' ' << z;
                    ++lit;
                } else if (isInside(low.x, high.x) && isInside(low.z, high.z)) {
                    // Where the plate's diagonal crosses the beam no triangle alone blocks all.
                    EXPECT_TRUE(kind == BeamKind::kDark || kind == BeamKind::kListed);
                    dark += kind == BeamKind::kDark;
                } else {
                    EXPECT_NE(kind, BeamKind::kDark) << x << ' ' << z;
                    listed += kind == BeamKind::kListed;
                }
            }
        EXPECT_GT(dark, 150u);
        EXPECT_GT(lit, 500u);
        EXPECT_GT(listed, 30u);
    }
}

TEST(Beams, AFrameMakesItsShareAndOldBeamsAreFoundAgain) {
    const Umbra umbra;
    BeamCache cache;
    const auto begin = [&](const Light& light, uint64_t mostMade) {
        cache.begin(umbra.stage.bvh.view(), umbra.stage.geometry, {&light, 1}, kBytes, mostMade);
    };
    const glm::vec3 low(3, 0.01f, 3), high(3.2f, 0.01f, 3.2f);
    begin(umbra.light, 1);
    EXPECT_EQ(umbra.kindOf(cache, low, high, 1), BeamKind::kOpen) << "one ray: others first";
    begin(umbra.light, 1);
    EXPECT_EQ(umbra.kindOf(cache, low, high, 1), BeamKind::kLit);
    EXPECT_EQ(umbra.kindOf(cache, low, high, 2), BeamKind::kOpen) << "the frame's share is used";
    EXPECT_EQ(cache.counts().madeCount, 1u);
    begin(umbra.light, 0);
    EXPECT_EQ(umbra.kindOf(cache, low, high, 1), BeamKind::kLit) << "kept";
    EXPECT_EQ(cache.counts().madeCount, 0u);

    TruthGeometry larger = umbra.stage.geometry; // something moved outwards
    larger.diagonal *= 1.001;
    cache.begin(umbra.stage.bvh.view(), larger, {&umbra.light, 1}, kBytes, 0);
    EXPECT_EQ(umbra.kindOf(cache, low, high, 1), BeamKind::kLit) << "kept";

    Light moved = umbra.light;
    moved.positionWorld.x += 1.0f;
    begin(moved, BeamCache::kMakeAll);
    EXPECT_EQ(umbra.kindOf(cache, low, high, 1), BeamKind::kOpen) << "it moved in this frame";
    begin(moved, BeamCache::kMakeAll);
    EXPECT_EQ(umbra.kindOf(cache, low, high, 1), BeamKind::kLit) << "it stands still again";
    EXPECT_EQ(cache.counts().madeCount, 1u);
}

TEST(Beams, OfManyRaysComeFirstAndNoFrameWaits) {
    const Umbra umbra;
    BeamCache cache;
    const auto begin = [&] {
        cache.begin(umbra.stage.bvh.view(), umbra.stage.geometry, {&umbra.light, 1}, kBytes, 10);
    };
    // Keys 1 to 100 serve one ray each and are asked first, keys 101 to 115 serve nine.
    const auto ask = [&] {
        const glm::vec3 low(3, 0.01f, 3), high(3.2f, 0.01f, 3.2f);
        uint32_t known[2] = {0, 0};
        for (uint64_t key = 1; key <= 115; ++key)
            known[key > 100] +=
                umbra.kindOf(cache, low, high, key, key > 100 ? 9 : 1) != BeamKind::kOpen;
        return std::pair(known[0], known[1]);
    };
    uint32_t made = 0;
    for (int frame = 0; frame < 13; ++frame) {
        begin();
        const auto [single, many] = ask();
        const uint64_t now = cache.counts().madeCount;
        EXPECT_EQ(now, std::min(10u, 115 - made)) << "no frame waits: " << frame;
        made += uint32_t(now);
        EXPECT_EQ(single + many, made) << "what was made is kept";
        EXPECT_EQ(many, frame == 0 ? 5u : 15u)
            << "half goes to those of fewer rays at first: " << frame;
    }
    EXPECT_EQ(made, 115u);
}

/// Renders by rays of a world with beams and without, and compares.
class TwoRenderers {
public:
    TwoRenderers(const World& world, uint64_t beamBytes)
        : with_(Backend::kCpu, world, none_), without_(Backend::kCpu, world, none_) {
        options_.width = 192;
        options_.height = 108;
        options_.rays.believe = 0.0f;
        options_.rays.beamBytes = beamBytes;
    }

    void worldChanged(const std::vector<uint32_t>& moved) {
        with_.worldChanged(moved);
        without_.worldChanged(moved);
    }
    /// @return the counts of the frame with beams
    FrameCounts compare(const Camera& camera, const char* model = "texels:inf") {
        FrameOptions plain = options_;
        plain.rays.beamBytes = 0;
        const FrameResult with = with_.render(camera, *makeCostModel(model), options_),
                          without = without_.render(camera, *makeCostModel(model), plain);
        EXPECT_EQ(with.visibility, without.visibility);
        EXPECT_EQ(with.color, without.color);
        EXPECT_EQ(with.pairServer, without.pairServer);
        EXPECT_EQ(with.counts.exactRayCount, without.counts.exactRayCount);
        EXPECT_EQ(with.counts.moverTestCount, without.counts.moverTestCount);
        EXPECT_EQ(without.counts.beamRayCount, 0u);
        return with.counts;
    }
    FrameRenderer& with() { return with_; }
    FrameOptions& options() { return options_; }

private:
    Dag none_;
    FrameRenderer with_, without_;
    FrameOptions options_;
};

TEST(Beams, FramesAreThoseWithoutBeamsWhileAllMoves) {
    for (const char* name : {"atrium", "houses", "fail-alpha"}) {
        SCOPED_TRACE(name);
        const Scene scene = makeBuiltin(name);
        World world(scene, {});
        Camera camera = world.cameras().at(0);
        TwoRenderers both(world, kBytes);
        uint64_t answered = 0, asked = 0;
        for (int frame = 0; frame < 16; ++frame) {
            SCOPED_TRACE(frame);
            both.options().makeAllBeams = frame % 3 == 0;
            if (frame % 8 >= 4) { // 4 still frames, 4 that move
                both.worldChanged(world.setTime(0.05f * float(frame)));
                camera.positionWorld += glm::vec3(0.03f, 0.01f, -0.02f);
            }
            const FrameCounts counts =
                both.compare(camera, frame % 6 == 5 ? "texels:200" : "texels:inf");
            answered += counts.beamRayCount;
            asked += counts.exactRayCount;
        }
        EXPECT_GT(answered, asked / 10);
        EXPECT_GT(both.with().beamBytes(), 0u);
    }
}

TEST(Beams, LittleMemoryChangesNoAnswer) {
    const Scene scene = makeBuiltin("atrium");
    World world(scene, {});
    Camera camera = world.cameras().at(0);
    TwoRenderers both(world, BeamCache::kLeastBytes);
    both.options().makeAllBeams = true;
    uint64_t answered = 0;
    setThreadCount(8); // they meet at the limit
    for (int frame = 0; frame < 12; ++frame) {
        SCOPED_TRACE(frame);
        camera.positionWorld += glm::vec3(0.3f, 0.0f, 0.2f);
        answered += both.compare(camera).beamRayCount;
        EXPECT_LE(both.with().beamBytes(), BeamCache::kLeastBytes);
    }
    setThreadCount(0);
    EXPECT_GT(answered, 0u);
}

TEST(Beams, AStillViewIsAnsweredByThemAlone) {
    const Scene scene = makeBuiltin("atrium");
    World world(scene, {});
    const Camera camera = world.cameras().at(0);
    TwoRenderers both(world, kBytes);
    FrameOptions options = both.options();
    options.start = FrameStart::kWarm;
    const FrameResult warm = renderFrom(both.with(), camera, *makeCostModel("texels:inf"), options);
    EXPECT_EQ(warm.counts.beamMadeCount, 0u);
    EXPECT_GT(warm.counts.beamRayCount, warm.counts.exactRayCount / 10 * 9);
    options.start = FrameStart::kCold;
    const FrameResult cold = renderFrom(both.with(), camera, *makeCostModel("texels:inf"), options);
    EXPECT_EQ(cold.counts.beamRayCount, 0u);
    EXPECT_EQ(cold.visibility, warm.visibility);
    // Until all are made a frame makes its share.
    uint64_t made = 0;
    for (int frame = 0; frame < 400; ++frame) {
        const FrameCounts counts =
            both.with().render(camera, *makeCostModel("texels:inf"), options).counts;
        EXPECT_LE(counts.beamMadeCount, std::max<uint64_t>(counts.exactRayCount / 240,
                                                           options.width * options.height / 64));
        made += counts.beamMadeCount;
        if (counts.beamMadeCount == 0)
            break;
        ASSERT_LT(frame, 399);
    }
    EXPECT_GT(made, 1000u);
}

TEST(Beams, AreMadeWhileTheViewStandsAndAskedWhileTheyAnswerMost) {
    const Scene scene = makeBuiltin("atrium");
    World world(scene, {});
    Camera camera = world.cameras().at(0);
    TwoRenderers both(world, kBytes);
    FrameCounts counts = both.compare(camera);
    EXPECT_EQ(counts.beamRayCount + counts.beamMadeCount, 0u) << "the first frame";
    EXPECT_EQ(both.with().beamBytes(), 0u);
    counts = both.compare(camera);
    EXPECT_GT(counts.beamMadeCount, 0u) << "it stands still";
    camera.positionWorld.x += 0.001f;
    counts = both.compare(camera);
    EXPECT_EQ(counts.beamRayCount + counts.beamMadeCount, 0u) << "it moves, and few are known";
    both.options().makeAllBeams = true;
    for (int frame = 0; frame < 4; ++frame)
        both.compare(camera);
    both.options().makeAllBeams = false;
    camera.positionWorld.x += 0.001f;
    counts = both.compare(camera);
    EXPECT_EQ(counts.beamMadeCount, 0u) << "it moves";
    EXPECT_GT(2 * counts.beamRayCount, counts.exactRayCount) << "most are known";
    camera.forward = -camera.forward;
    for (int frame = 0; frame < 2; ++frame) {
        camera.positionWorld.x += 0.001f;
        counts = both.compare(camera);
    }
    EXPECT_EQ(counts.beamRayCount + counts.beamMadeCount, 0u) << "another view";
    EXPECT_GT(both.compare(camera).beamMadeCount, 0u) << "it stands still again";
}

TEST(Beams, RecordingTakesNoPartInThem) {
    const Scene scene = makeBuiltin("atrium");
    World world(scene, {});
    const Camera camera = world.cameras().at(0);
    const Dag none;
    FrameRenderer recording(Backend::kCpu, world, none), silent(Backend::kCpu, world, none);
    FrameOptions options;
    options.width = 96;
    options.height = 54;
    options.rays.believe = 0.0f;
    options.rays.beamBytes = kBytes;
    const auto model = makeCostModel("texels:inf");
    setThreadCount(1); // which beams a frame makes depends on the threads' order
    for (int frame = 0; frame < 12; ++frame) {
        options.recordPairs = true;
        const FrameCounts with = recording.render(camera, *model, options).counts;
        options.recordPairs = false;
        const FrameCounts without = silent.render(camera, *model, options).counts;
        EXPECT_EQ(with.beamMadeCount, without.beamMadeCount) << frame;
        EXPECT_EQ(with.beamRayCount, without.beamRayCount) << frame;
        EXPECT_EQ(recording.beamBytes(), silent.beamBytes()) << frame;
    }
    setThreadCount(0);
    EXPECT_GT(silent.beamBytes(), 0u);
}

TEST(Beams, FullMemoryEndsTheSearchForMore) {
    const Scene scene = makeBuiltin("atrium");
    World world(scene, {});
    TwoRenderers both(world, BeamCache::kLeastBytes);
    both.options().makeAllBeams = true;
    uint64_t made = 0, idle = 0;
    for (int frame = 0; frame < 40; ++frame) {
        const uint64_t now = both.compare(world.cameras().at(0)).beamMadeCount;
        made += now;
        idle += now == 0;
    }
    EXPECT_GT(made, 1000u);
    EXPECT_GE(idle, 28u) << "memory is put in order every 32 frames";
}

TEST(Beams, AnswersDoNotDependOnThreads) {
    const Scene scene = makeBuiltin("houses");
    World world(scene, {});
    const Camera camera = world.cameras().at(0);
    TwoRenderers both(world, kBytes);
    both.options().makeAllBeams = true;
    for (const int threads : {1, 8, 3}) {
        setThreadCount(threads);
        both.compare(camera);
        both.with().reset();
        both.compare(camera);
    }
    setThreadCount(0);
}

TEST(Beams, OptionsThatMakeNoSenseAreRefused) {
    const Scene scene = makeBuiltin("fail-contact");
    World world(scene, {});
    const Dag none;
    FrameRenderer renderer(Backend::kCpu, world, none);
    FrameOptions options;
    options.width = 32;
    options.height = 18;
    options.rays.believe = 0.0f;
    for (const uint64_t bytes : {uint64_t(1), BeamCache::kLeastBytes - 1, uint64_t(17) << 30}) {
        options.rays.beamBytes = bytes;
        EXPECT_THROW(renderer.render(world.cameras().at(0), *makeCostModel("texels:inf"), options),
                     Error);
    }
}

} // namespace
} // namespace shadowdag::test

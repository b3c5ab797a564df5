// SPDX-License-Identifier: Apache-2.0
// Compares the OpenGL backend with the CPU's, pair by pair, as a table on standard output:
// differences, and times of frames on both. Times are medians of three frames without kept state,
// after an uncounted one (drivers compile shaders at first use). Differences are compared with the
// tests' bounds before times are printed.
//
//     gl_bench [WIDTH HEIGHT [VOXELS]]      640 360 1024 by default
#include "cuda/statistics.h"
#include "scenes/builtin.h"
#include "shadowmap/gl_pages.h"
#include "tests/hybrid/gl_parity.h"
#include "voxel/voxelize.h"

#include <bit>
#include <cstdio>
#include <cstdlib>
#include <memory>

namespace shadowdag {
namespace {

struct Timed {
    FrameResult frame;
    double frameMs = 0, gbufferMs = 0, mapsMs = 0, commitMs = 0, shadingMs = 0;
};

Timed render(FrameRenderer& renderer, const World& world, const std::string& model,
             FrameOptions options) {
    Timed timed;
    std::vector<double> frame, gbuffer, maps, commit, shading;
    for (int repeat = 0; repeat < 4; ++repeat) {
        renderer.reset();
        options.recordPairs = repeat == 3;
        timed.frame = renderer.render(world.cameras().at(0), *makeCostModel(model), options);
        if (repeat == 0)
            continue;
        const StageTimes& stages = timed.frame.stages;
        frame.push_back(stages.totalMs());
        gbuffer.push_back(stages.stageMs("g-buffer"));
        maps.push_back(stages.stageMs("rasterization"));
        commit.push_back(stages.stageMs("page commit"));
        shading.push_back(stages.stageMs("shading"));
    }
    timed.frameMs = median(frame);
    timed.gbufferMs = median(gbuffer);
    timed.mapsMs = median(maps);
    timed.commitMs = median(commit);
    timed.shadingMs = median(shading);
    return timed;
}

int run(uint32_t width, uint32_t height, uint32_t voxels) {
    std::fprintf(stderr, "%s\n", describeGlPages(GlPages::kAuto, glDeviceInfo()).c_str());
    std::printf("| scene | method | pairs | other triangle | dark on one | of these by rays | "
                "visibility differs | cpu ms: frame, g-buffer, drawing, shading | gl ms: frame, "
                "g-buffer, commits, drawing, shading |\n|---|---|---|---|---|---|---|---|---|\n");
    int status = 0;
    for (const char* name : {"atrium", "houses", "necropolis"}) {
        const Scene scene = makeBuiltin(name);
        World world(scene, {});
        const Dag dag = voxelize(world.triangles(), viewOf(world.staticTriangles()),
                                 gridAround(world.boundsWorld(), std::bit_width(voxels) - 1));
        FrameRenderer cpu(Backend::kCpu, world, dag), gl(Backend::kGl, world, dag);
        FrameOptions options;
        options.width = width;
        options.height = height;
        for (const auto& [method, model] :
             {std::pair("dag", "texels:inf"), std::pair("maps", "texels:0"),
              std::pair("hybrid", "texels:96")}) {
            const Timed a = render(cpu, world, model, options);
            const Timed b = render(gl, world, model, options);
            const test::GlParity p =
                test::compareFrames(a.frame, cpu.gbuffer(), b.frame, gl.gbuffer());
            if (p.unlikeSampleCount || p.unlikePairListCount || p.unlikeDarkPercent() > 0.1) {
                std::fprintf(stderr, "%s %s differs by more than tests allow\n", name, method);
                status = 1;
            }
            std::printf("| %s | %s | %llu | %.2f %% | %llu (%.4f %%) | %llu | %.3f %% | "
                        "%.0f, %.0f, %.0f, %.0f | %.0f, %.0f, %.0f, %.0f, %.0f |\n",
                        name, method, static_cast<unsigned long long>(p.pairCount),
                        100.0 - p.sameTrianglePercent(),
                        static_cast<unsigned long long>(p.unlikeDarkCount), p.unlikeDarkPercent(),
                        static_cast<unsigned long long>(p.unlikeRayCount),
                        p.unlikeVisibilityPercent(), a.frameMs, a.gbufferMs, a.mapsMs, a.shadingMs,
                        b.frameMs, b.gbufferMs, b.commitMs, b.mapsMs, b.shadingMs);
            std::fflush(stdout);
        }
    }
    return status;
}

} // namespace
} // namespace shadowdag

int main(int argc, char** argv) {
    try {
        const auto number = [&](int i, int usual) {
            return uint32_t(argc > i ? std::atoi(argv[i]) : usual);
        };
        return shadowdag::run(number(1, 640), number(2, 360), number(3, 1024));
    } catch (const std::exception& error) {
        std::fprintf(stderr, "gl_bench: %s\n", error.what());
        return 1;
    }
}

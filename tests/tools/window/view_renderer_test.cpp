// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_renderer.h"

#include "hybrid/gbuffer/tone_map.h"
#include "hybrid/judge/truth.h"
#include "tests/tools/temporary_directory.h"
#include "tools/settings/json_file.h"
#include "tools/settings/setting.h"
#include "tools/window/view_overlay.h"
#include "tools/window/view_save.h"
#include "tools/window/view_scene.h"
#include "tools/workspace/image_io.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace shadowdag {

namespace {

/// A window's renderer over one scene, with a cache of its own.
struct Opened {
    explicit Opened(const std::string& scene = "builtin:fail-silhouette", uint32_t log2 = 7)
        : renderer(settings()) {
        info = renderer.open(scene, "", log2, "", Console(false));
    }
    ViewSettings settings() const {
        ViewSettings settings;
        settings.cacheDirectory = directory.path();
        return settings;
    }
    ViewRequest request(const std::string& method, uint32_t width = 160, uint32_t height = 90) {
        ViewRequest request;
        request.serial = ++serial;
        request.sides[0] = {method, "texels:96"};
        request.sides[1] = {"truth", ""};
        request.options.width = width;
        request.options.height = height;
        return request;
    }
    std::shared_ptr<ViewPicture> whole(const ViewRequest& request) {
        std::shared_ptr<ViewPicture> picture = renderer.render(request, 1.0f);
        while (renderer.refine(1e9)) {
        }
        return renderer.picture();
    }

    TemporaryDirectory directory;
    ViewRenderer renderer;
    ViewSceneInfo info;
    uint64_t serial = 0;
};

TEST(ViewRenderer, ErrorsAreThoseOfTheErrorAnalysis) {
    Opened opened;
    ViewRequest request = opened.request("dag");
    request.wantsError = true;
    const std::shared_ptr<ViewPicture> picture = opened.whole(request);
    ASSERT_TRUE(picture->isFinal);
    ASSERT_TRUE(picture->sides[0].errors.has_value());
    const ViewErrors& errors = *picture->sides[0].errors;
    EXPECT_EQ(errors.doneShare, 1.0);

    // The same frame by the library.
    const LoadedScene scene =
        loadSceneAndWorld("builtin:fail-silhouette", -1, 1, true, Console(false));
    VoxelSource source;
    source.cacheDirectory = opened.directory.path();
    const Dag dag = cachedDag(scene, 7, source, Console(false));
    FrameRenderer renderer(Backend::kCpu, *scene.world, dag);
    const std::unique_ptr<CostModel> model = makeCostModel("texels:inf");
    const FrameResult frame =
        renderer.render(chooseCamera(*scene.world, ""), *model, request.options);
    const Truth truth(*scene.world);
    const std::vector<uint8_t> lit =
        truth.visibility(renderer.gbuffer(), scene.world->lights(), frame.pairs);
    const ErrorReport report = computeError(renderer, frame, *scene.world, truth, lit, {});
    EXPECT_EQ(errors.pairCount, report.total.pairCount);
    EXPECT_EQ(errors.falseShadowCount, report.total.falseShadowCount);
    EXPECT_EQ(errors.falseLightCount, report.total.falseLightCount);
    EXPECT_GT(errors.falseShadowCount, 0u);
}

TEST(ViewRenderer, ASmallerPictureIsThatOfItsSize) {
    Opened opened;
    ViewRequest moving = opened.request("maps", 320, 180);
    moving.isMoving = true;
    const std::shared_ptr<ViewPicture> small = opened.renderer.render(moving, 0.25f);
    EXPECT_FALSE(small->isFinal);
    const std::shared_ptr<ViewPicture> asked =
        opened.renderer.render(opened.request("maps", 80, 45), 1.0f);
    EXPECT_EQ(small->width, asked->width);
    EXPECT_EQ(small->height, asked->height);
    EXPECT_EQ(small->sides[0].rgba, asked->sides[0].rgba);
    ASSERT_EQ(small->sides[0].maps.size(), asked->sides[0].maps.size());
    for (size_t i = 0; i < small->sides[0].maps.size(); ++i)
        EXPECT_EQ(small->sides[0].maps[i].quantities.texels,
                  asked->sides[0].maps[i].quantities.texels)
            << i;
}

// What moves between whole pictures leaves nothing in them.
TEST(ViewRenderer, ACompletePictureIsIndependent) {
    Opened opened;
    ViewRequest request = opened.request("maps", 160, 90);
    const std::shared_ptr<ViewPicture> first = opened.renderer.render(request, 1.0f);
    for (const float scale : {0.25f, 0.5f, 1.0f}) {
        ViewRequest moving = request;
        moving.isMoving = true;
        moving.options.undersample = 3;
        opened.renderer.render(moving, scale);
        const std::shared_ptr<ViewPicture> again = opened.renderer.render(request, 1.0f);
        EXPECT_TRUE(again->sides[0].rgba == first->sides[0].rgba) << scale;
    }
}

TEST(ViewRenderer, TheTruthsSideIsCompleteWhileItMoves) {
    Opened opened;
    ViewRequest request = opened.request("truth");
    request.isMoving = true;
    const std::shared_ptr<ViewPicture> moving = opened.renderer.render(request, 1.0f);
    EXPECT_FALSE(opened.renderer.canRefine());
    request.isMoving = false;
    const std::shared_ptr<ViewPicture> first = opened.renderer.render(request, 1.0f);
    EXPECT_TRUE(opened.renderer.canRefine());
    EXPECT_FALSE(first->isFinal);
    while (opened.renderer.refine(1e9)) {
    }
    const std::shared_ptr<ViewPicture> last = opened.renderer.picture();
    EXPECT_TRUE(last->isFinal);
    EXPECT_EQ(last->sides[0].rgba, moving->sides[0].rgba);
    EXPECT_NE(first->sides[0].rgba, last->sides[0].rgba) << "every eighth sample is not all";
}

TEST(ViewRenderer, EveryOverlayDrawsSomethingElse) {
    Opened opened;
    std::vector<std::vector<uint8_t>> seen;
    for (size_t overlay = 0; overlay < kOverlayNames.size(); ++overlay) {
        ViewRequest request = opened.request("maps");
        request.overlay = ViewOverlay(overlay);
        const std::shared_ptr<ViewPicture> picture = opened.whole(request);
        ASSERT_EQ(picture->sides[0].rgba.size(), 160u * 90 * 4) << kOverlayNames[overlay];
        for (const std::vector<uint8_t>& other : seen)
            EXPECT_NE(picture->sides[0].rgba, other) << kOverlayNames[overlay];
        seen.push_back(picture->sides[0].rgba);
        EXPECT_EQ(picture->legend.title.empty(), overlay == 0) << kOverlayNames[overlay];
    }
    EXPECT_EQ(seen.size(), 12u);
}

TEST(ViewRenderer, AnOverlayWithoutItsDataReportsIt) {
    Opened opened;
    ViewRequest request = opened.request("dag");
    request.overlay = ViewOverlay::kPages;
    EXPECT_EQ(opened.whole(request)->legend.title, "no map of that light is drawn");
    EXPECT_TRUE(opened.whole(request)->mapRgba.empty());
}

TEST(ViewRenderer, APixelReportsTheResultOfEveryMethod) {
    Opened opened;
    ViewRequest request = opened.request("maps");
    request.pixel = glm::vec2(0.5f, 0.8f);
    const std::shared_ptr<ViewPicture> picture = opened.whole(request);
    ASSERT_TRUE(picture->pixel.has_value());
    const PixelReport& pixel = *picture->pixel;
    EXPECT_EQ(pixel.x, 80u);
    EXPECT_EQ(pixel.y, 72u);
    ASSERT_TRUE(pixel.hasSample);
    ASSERT_FALSE(pixel.pairs.empty());
    for (const PixelPair& pair : pixel.pairs) {
        EXPECT_EQ(pair.servedBy, "map");
        EXPECT_GT(pair.faceTexels, 0u);
        ASSERT_EQ(pair.answers.size(), 4u);
        EXPECT_EQ(pair.answers[0].method, "dag believe all");
        EXPECT_EQ(pair.answers[1].method, "dag believe none");
        EXPECT_EQ(pair.answers[2].method, "maps");
        EXPECT_EQ(pair.answers[3].method, "truth");
        EXPECT_EQ(pair.answers[1].visibility, pair.answers[3].visibility);
        for (const PairResult& answer : pair.answers) {
            EXPECT_GT(answer.nanoseconds, 0.0) << answer.method;
            EXPECT_EQ(answer.blocker.empty(), answer.visibility == 255) << answer.method;
        }
    }
}

// A click in the moment between a drag's end and rest: the same pixel comes twice, and is told once
// the picture rests.
TEST(ViewRenderer, APixelRequestedWhileThePictureMovesIsReportedAtRest) {
    Opened opened;
    ViewRequest request = opened.request("maps");
    ASSERT_FALSE(opened.whole(request)->pixel.has_value());
    request.pixel = glm::vec2(0.5f, 0.8f);
    request.isMoving = true;
    ASSERT_TRUE(opened.renderer.canRedraw(request));
    EXPECT_FALSE(opened.renderer.render(request, 1.0f)->pixel.has_value());
    request.isMoving = false;
    ASSERT_TRUE(opened.renderer.canRedraw(request));
    const std::shared_ptr<ViewPicture> rested = opened.renderer.render(request, 1.0f);
    ASSERT_TRUE(rested->pixel.has_value());
    EXPECT_EQ(rested->pixel->y, 72u);
}

TEST(ViewRenderer, FrozenFramesAreSeenByAnotherCamera) {
    Opened opened;
    ViewRequest request = opened.request("dag");
    const std::shared_ptr<ViewPicture> own = opened.whole(request);
    request.frozen = "0,3,8,0,0,0";
    request.camera = request.frozen;
    const std::shared_ptr<ViewPicture> same = opened.whole(request);
    request.frozen.clear();
    const std::shared_ptr<ViewPicture> plain = opened.whole(request);
    // From the frozen camera's own place the frame is seen as it is, but for the frustum's lines.
    size_t unlike = 0;
    for (size_t i = 0; i < plain->sides[0].rgba.size(); i += 4)
        unlike += !std::equal(plain->sides[0].rgba.begin() + ptrdiff_t(i),
                              plain->sides[0].rgba.begin() + ptrdiff_t(i) + 3,
                              same->sides[0].rgba.begin() + ptrdiff_t(i));
    EXPECT_LT(unlike, 160u * 90 / 20);
    request.frozen = "0,3,8,0,0,0";
    request.camera = "6,5,9,0,0,0";
    const std::shared_ptr<ViewPicture> aside = opened.whole(request);
    EXPECT_NE(aside->sides[0].rgba, same->sides[0].rgba);
    EXPECT_THROW(opened.renderer.save(request, opened.directory.path()), Error);
}

TEST(ViewRenderer, AFailedOpenKeepsTheOpenScene) {
    Opened opened;
    EXPECT_THROW(opened.renderer.open("no-such.glb", "", 7, "", Console(false)), Error);
    EXPECT_THROW(opened.renderer.setVoxels(7, "no-such.svdag", Console(false)), Error);
    EXPECT_THROW(
        opened.renderer.open("builtin:fail-mover", "no such camera", 7, "", Console(false)), Error);
    EXPECT_TRUE(opened.renderer.isOpen());
    EXPECT_FALSE(opened.whole(opened.request("dag"))->sides[0].rgba.empty());
}

TEST(ViewRenderer, AFailedRequestCanBeCorrected) {
    Opened opened;
    ViewRequest request = opened.request("hybrid");
    request.sides[0].model = "expr:texels <";
    EXPECT_THROW(opened.renderer.render(request, 1.0f), Error);
    EXPECT_FALSE(opened.renderer.canRefine());
    request.sides[0].model = "expr:texels < 96";
    EXPECT_FALSE(opened.renderer.render(request, 1.0f)->sides[0].rgba.empty());
    request.sides[0].model = "cost";
    EXPECT_THROW(opened.renderer.render(request, 1.0f), Error) << "it has no calibration";
}

TEST(ViewRenderer, TimeMovesAnimatedObjects) {
    Opened opened("builtin:fail-mover");
    EXPECT_TRUE(opened.info.isAnimated());
    ViewRequest request = opened.request("dag");
    const std::vector<uint8_t> first = opened.whole(request)->sides[0].rgba;
    request.frame = 20;
    EXPECT_NE(opened.whole(request)->sides[0].rgba, first);
    request.frame = 0;
    EXPECT_EQ(opened.whole(request)->sides[0].rgba, first);
}

void expectSameStages(const SideReport& a, const SideReport& b) {
    EXPECT_EQ(a.stages.stagesMs, b.stages.stagesMs) << "times of one frame are equal to the bit";
}

TEST(ViewRenderer, OtherOverlaysAreDrawnFromTheExistingFrameAndTruth) {
    Opened opened, other;
    ViewRequest request = opened.request("hybrid");
    request.wantsError = true;
    const std::shared_ptr<ViewPicture> first = opened.whole(request);
    other.whole(request); // finds the same exposure
    for (size_t overlay = 0; overlay < kOverlayNames.size(); ++overlay)
        for (const float stops : {0.0f, 1.0f}) {
            SCOPED_TRACE(kOverlayNames[overlay]);
            request.overlay = ViewOverlay(overlay);
            request.exposureStops = stops;
            request.voxelLevel = uint32_t(overlay) % 3;
            request.light = stops > 0 ? 0 : -1;
            request.wantsMap = stops > 0;
            ASSERT_TRUE(opened.renderer.canRedraw(request));
            const std::shared_ptr<ViewPicture> again = opened.renderer.render(request, 1.0f);
            expectSameStages(again->sides[0], first->sides[0]);
            EXPECT_TRUE(again->isFinal) << "the truth was asked in full";
            EXPECT_EQ(again->sides[0].errors->falseShadowCount,
                      first->sides[0].errors->falseShadowCount);
            ViewRequest elsewhere = request; // rendered anew
            elsewhere.camera = "0,3,8,0,0,0";
            other.renderer.render(elsewhere, 1.0f);
            ASSERT_FALSE(other.renderer.canRedraw(request));
            const std::shared_ptr<ViewPicture> anew = other.whole(request);
            EXPECT_EQ(again->sides[0].rgba, anew->sides[0].rgba);
            EXPECT_EQ(again->mapRgba, anew->mapRgba);
            EXPECT_EQ(again->legend.title, anew->legend.title);
        }
}

TEST(ViewRenderer, ChangesOfTheFrameAreRendered) {
    Opened opened("builtin:fail-mover");
    const ViewRequest request = opened.request("hybrid");
    opened.whole(request);
    ASSERT_TRUE(opened.renderer.canRedraw(request));
    const auto refuses = [&](const auto& change) {
        ViewRequest changed = request;
        change(changed);
        return !opened.renderer.canRedraw(changed);
    };
    EXPECT_TRUE(refuses([](ViewRequest& r) { r.camera = "0,3,8,0,0,0"; }));
    EXPECT_TRUE(refuses([](ViewRequest& r) { r.frozen = "0,3,8,0,0,0"; }));
    EXPECT_TRUE(refuses([](ViewRequest& r) { r.frame = 1; }));
    EXPECT_TRUE(refuses([](ViewRequest& r) { r.sides[0].model = "texels:97"; }));
    EXPECT_TRUE(refuses([](ViewRequest& r) { r.isSplit = true; }));
    EXPECT_TRUE(refuses([](ViewRequest& r) { r.options.width += 1; }));
    EXPECT_TRUE(refuses([](ViewRequest& r) { r.options.bias.taps = 1; }));
    EXPECT_TRUE(refuses([](ViewRequest& r) { r.wantsError = true; })) << "no pairs are recorded";
    EXPECT_TRUE(refuses([](ViewRequest& r) { r.overlay = ViewOverlay::kErrors; }));
    EXPECT_TRUE(refuses([](ViewRequest& r) {
        r.overlay = ViewOverlay::kSteps; // rays at every pixel, while it moves
        r.isMoving = true;
    }));
    EXPECT_FALSE(refuses([](ViewRequest& r) {
        r.exposureStops = 1;
        r.isMoving = true;
    }));
    ViewRequest moving = request;
    moving.isMoving = true;
    opened.renderer.render(moving, 0.5f);
    EXPECT_FALSE(opened.renderer.canRedraw(request)) << "a small picture stands for nothing";
}

TEST(ViewRenderer, AFrozenFrameIsKeptWhileTheObserverMoves) {
    Opened opened;
    ViewRequest request = opened.request("dag");
    request.frozen = "0,3,8,0,0,0";
    request.camera = "6,5,9,0,0,0";
    const std::shared_ptr<ViewPicture> first = opened.whole(request);
    request.camera = "-6,5,9,0,0,0";
    const std::shared_ptr<ViewPicture> second = opened.renderer.render(request, 1.0f);
    expectSameStages(second->sides[0], first->sides[0]);
    EXPECT_NE(second->sides[0].rgba, first->sides[0].rgba);
}

TEST(ViewRenderer, CancelledPicturesLeaveNoState) {
    Opened opened;
    for (const char* method : {"maps", "hybrid", "truth"}) {
        SCOPED_TRACE(method);
        ViewRequest request = opened.request(method);
        request.wantsError = true;
        const std::vector<uint8_t> expected = opened.whole(request)->sides[0].rgba;
        ViewRequest elsewhere = request;
        elsewhere.camera = "0,3,8,0,0,0";
        int count = 0;
        opened.renderer.render(elsewhere, 1.0f, {[&] { return ++count < 0; }, {}});
        ASSERT_GT(count, method == std::string("truth") ? 1 : 8);
        for (int last = 1; last <= count; ++last) {
            opened.whole(request);
            int asked = 0;
            const ViewHooks hooks{[&] { return ++asked == last; }, {}};
            EXPECT_THROW(opened.renderer.render(elsewhere, 1.0f, hooks), PictureGivenUp) << last;
            EXPECT_FALSE(opened.renderer.canRefine());
            EXPECT_FALSE(opened.renderer.canRedraw(elsewhere));
            EXPECT_EQ(opened.whole(request)->sides[0].rgba, expected) << last;
        }
    }
}

TEST(ViewRenderer, ACancelledRedrawKeepsTheFrames) {
    Opened opened;
    ViewRequest request = opened.request("maps");
    const std::shared_ptr<ViewPicture> first = opened.whole(request);
    request.exposureStops = 1;
    ASSERT_TRUE(opened.renderer.canRedraw(request));
    EXPECT_THROW(opened.renderer.render(request, 1.0f, {[] { return true; }, {}}), PictureGivenUp);
    ASSERT_TRUE(opened.renderer.canRedraw(request));
    const std::shared_ptr<ViewPicture> again = opened.renderer.render(request, 1.0f);
    expectSameStages(again->sides[0], first->sides[0]);
    EXPECT_NE(again->sides[0].rgba, first->sides[0].rgba);
    request.frozen = "0,3,8,0,0,0"; // one that fails leaves nothing
    opened.whole(request);
    request.camera = "no such camera";
    ASSERT_TRUE(opened.renderer.canRedraw(request));
    EXPECT_THROW(opened.renderer.render(request, 1.0f), Error);
    EXPECT_FALSE(opened.renderer.canRedraw(request));
}

TEST(ViewRenderer, ACancelledRefinementContinues) {
    Opened opened;
    ViewRequest request = opened.request("truth");
    opened.renderer.render(request, 1.0f);
    ASSERT_TRUE(opened.renderer.canRefine());
    EXPECT_THROW(opened.renderer.picture({[] { return true; }, {}}), PictureGivenUp);
    ASSERT_TRUE(opened.renderer.canRefine());
    while (opened.renderer.refine(1e9)) {
    }
    EXPECT_TRUE(opened.renderer.picture()->isFinal);
}

TEST(ViewRenderer, TheOracleMeasuresOnceTheViewRestsAndKeepsItsCosts) {
    Opened opened;
    ViewRequest request = opened.request("hybrid");
    request.sides[0].model = "oracle";
    request.wantsError = true;
    int measured = 0;
    const ViewHooks hooks{{}, [&](const std::string& work) { measured += !work.empty(); }};
    const auto notesOf = [&](const ViewRequest& asked, float scale) {
        std::string notes;
        const std::shared_ptr<ViewPicture> picture = opened.renderer.render(asked, scale, hooks);
        for (const std::string& note : picture->notes)
            notes += note + "\n";
        return notes;
    };
    ViewRequest moving = request;
    moving.isMoving = true;
    EXPECT_NE(notesOf(moving, 0.5f).find("until then texels:96 routes"), std::string::npos);
    EXPECT_EQ(measured, 0) << "a picture that moves waits for no measurement";
    EXPECT_NE(notesOf(request, 1).find("are kept until the view changes"), std::string::npos);
    EXPECT_EQ(measured, 1);
    notesOf(moving, 0.5f);
    notesOf(request, 1); // the same view, after another picture
    request.overlay = ViewOverlay::kMethods;
    notesOf(request, 1);
    EXPECT_EQ(measured, 1);
    request.camera = "0,3,8,0,0,0";
    notesOf(request, 1);
    EXPECT_EQ(measured, 2);
    request.frame = 1;
    notesOf(request, 1);
    request.options.undersample = 2;
    notesOf(request, 1);
    EXPECT_EQ(measured, 4);
}

TEST(ViewRenderer, CostsOfAnotherCameraAreNamedBesideThePicture) {
    Opened opened;
    FrameCosts costs;
    for (uint32_t light = 0; light < opened.info.lights.size(); ++light)
        costs.maps.push_back({light, 0, 1, 2});
    CostSource source;
    source.path = "c.json";
    source.table.emplace();
    (*source.table)[{"builtin:fail-silhouette", 0}] = {costs, {{"camera_numbers", "elsewhere"}}};
    opened.renderer.setCosts(source);
    ViewRequest request = opened.request("hybrid");
    request.sides[0].model = "oracle";
    const std::shared_ptr<ViewPicture> picture = opened.renderer.render(request, 1);
    ASSERT_EQ(picture->notes.size(), 1u);
    EXPECT_NE(picture->notes[0].find(
                  "c.json: its costs of builtin:fail-silhouette frame 0, cold were measured with "
                  "camera_numbers \"elsewhere\" instead of"),
              std::string::npos)
        << picture->notes[0];
}

TEST(ViewRenderer, SavedExposuresMakeTheSamePicture) {
    Opened opened;
    ViewRequest request = opened.request("dag");
    request.exposureStops = 1.5f;
    const SavedView saved = opened.renderer.save(request, opened.directory.path());
    const Experiment e = experimentFromJson(readJsonFile(saved.experiment, ""), saved.experiment);
    EXPECT_GT(e.exposure, 0.0);
    const LoadedScene scene = loadSceneAndWorld(e.scenes[0], -1, 1, true, Console(false));
    VoxelSource source;
    source.cacheDirectory = opened.directory.path();
    const Dag dag = cachedDag(scene, 7, source, Console(false));
    FrameRenderer renderer(Backend::kCpu, *scene.world, dag);
    const FrameResult frame = renderer.render(chooseCamera(*scene.world, e.camera),
                                              *makeCostModel("texels:inf"), baseOptions(e));
    const std::string again = opened.directory / "again.png";
    writePng(again, e.width, e.height, toneMap(frame.color, e.exposureOf(frame.color)));
    EXPECT_EQ(readText(again), readText(saved.png));
    writePng(again, e.width, e.height, toneMap(frame.color, Experiment().exposureOf(frame.color)));
    EXPECT_NE(readText(again), readText(saved.png));
}

TEST(ViewRenderer, SavedExposuresAreValidInExperiments) {
    TemporaryDirectory directory;
    ViewSettings settings;
    settings.cacheDirectory = directory.path();
    settings.experiment.exposure = kMaxExposure;
    ViewRenderer renderer(settings);
    renderer.open("builtin:fail-silhouette", "", 6, "", Console(false));
    ViewRequest request;
    request.sides[0] = {"dag", ""};
    request.options.width = 32;
    request.options.height = 18;
    request.exposureStops = 6;
    const SavedView saved = renderer.save(request, directory.path());
    EXPECT_EQ(readJsonFile(saved.experiment, "")["exposure"].get<double>(), kMaxExposure);
}

TEST(ViewScene, VoxelsAreOfferedAsFarAsMemoryAllows) {
    constexpr uint64_t kMib = 1 << 20;
    EXPECT_EQ(largestVoxelsLog2(10, 0, ~0ull), 12u) << "nothing is known";
    EXPECT_EQ(largestVoxelsLog2(10, kMib, 0), 12u);
    // An octave takes 4 times, building 4 times that: 1 MiB at 2^10 is 256 at 2^13.
    EXPECT_EQ(largestVoxelsLog2(10, kMib, 256 * kMib), 13u);
    EXPECT_EQ(largestVoxelsLog2(10, kMib, 256 * kMib - 1), 12u);
    EXPECT_EQ(largestVoxelsLog2(12, 9 * kMib, 64ull << 30), 17u);
}

TEST(ViewRenderer, SavedViewsDescribeHowToReproduceThem) {
    Opened opened;
    ViewRequest request = opened.request("hybrid");
    request.sides[0].model = "texels:64";
    request.isSplit = true;
    request.camera = "0,3,8,0,0,0,50";
    request.options.bias.taps = request.options.maps.taps = 9;
    request.options.undersample = 2;
    const std::string directory = opened.directory.path() + "/views";
    const SavedView saved = opened.renderer.save(request, directory);
    EXPECT_EQ(saved.png, directory + "/view-0001.png");
    const Json json = readJsonFile(saved.experiment, "");
    const Experiment e = experimentFromJson(json, saved.experiment);
    EXPECT_EQ(e.scenes, std::vector<std::string>{"builtin:fail-silhouette"});
    EXPECT_EQ(e.camera, request.camera);
    EXPECT_EQ(e.width, 160u);
    EXPECT_EQ(e.methods, (std::vector<std::string>{"hybrid"}));
    EXPECT_EQ(e.thresholds, std::vector<float>{64});
    EXPECT_EQ(e.taps, std::vector<uint32_t>{9});
    EXPECT_EQ(e.undersample, std::vector<float>{2});
    EXPECT_EQ(e.resolutionLog2, std::vector<uint32_t>{7});
    EXPECT_FALSE(readText(saved.png).empty());
    EXPECT_FALSE(readText(saved.exr).empty());
    EXPECT_EQ(opened.renderer.save(request, directory).exr, directory + "/view-0002.exr")
        << "nothing is overwritten";
}

TEST(ViewSave, ADirectoryWithoutAFreeNumberIsNamed) {
    Opened opened;
    for (int number = 1; number < 10000; ++number) {
        char name[32];
        std::snprintf(name, sizeof name, "view-%04d.png", number);
        writeText(opened.directory / name, "");
    }
    try {
        opened.renderer.save(opened.request("maps", 16, 9), opened.directory.path());
        FAIL() << "a file was replaced";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kResource);
        EXPECT_NE(std::string(error.what()).find("contains view-0001 to view-9999"),
                  std::string::npos);
    }
}

TEST(ViewSave, EverySettingThatASideReadsIsSaved) {
    ViewRequest request;
    request.sides[0] = {"hybrid", "texels:96"};
    for (const Setting* setting : frameSettings())
        for (const char* text : {"2", "0.5", "1", "32", "512M"})
            try {
                const std::string before = setting->frameText(request.options);
                setting->setFrame(request.options, setting->option, text);
                if (setting->frameText(request.options) != before)
                    break;
            } catch (const Error&) {
                continue; // it is no value of this setting
            }
    request.options.routeMargin = 0; // of frames in sequence, which a view is not
    const Experiment e = experimentOf(request, Experiment(), "builtin:atrium", Dag(), 1.0f);
    for (const Setting* setting : frameSettings()) {
        if (setting->readBy == ReadBy::kExactRays)
            continue; // the rays believe some voxels
        EXPECT_EQ(setting->texts(e), std::vector<std::string>{setting->frameText(request.options)})
            << setting->key;
    }
    EXPECT_EQ(e.beamsMib, Experiment().beamsMib);
    request.options.rays.believe = 0.0f;
    EXPECT_EQ(experimentOf(request, Experiment(), "builtin:atrium", Dag(), 1.0f).beamsMib,
              (std::vector<uint32_t>{512}));
    request.options.rays.believe = 2.0f;
    request.sides[0] = {"maps", ""}; // compare refuses settings without a reader
    const Experiment maps = experimentOf(request, Experiment(), "builtin:atrium", Dag(), 1.0f);
    EXPECT_EQ(maps.offset, Experiment().offset);
    EXPECT_EQ(maps.taps, e.taps);
}

TEST(ViewOverlay, TheRampRisesInLightness) {
    float last = -1;
    for (int i = 0; i <= 32; ++i) {
        const glm::vec3 c = rampColor(float(i) / 32.0f);
        const float luminance = 0.2126f * c.r + 0.7152f * c.g + 0.0722f * c.b;
        EXPECT_GT(luminance, last) << i;
        last = luminance;
    }
    EXPECT_EQ(rampColor(-1), rampColor(0));
    EXPECT_EQ(rampColor(2), rampColor(1));
}

} // namespace

} // namespace shadowdag

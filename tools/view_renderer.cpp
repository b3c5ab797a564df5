// SPDX-License-Identifier: Apache-2.0
#include "tools/view_renderer.h"

#include "cuda/parallel_for.h"
#include "gl/context.h"
#include "hybrid/error.h"
#include "hybrid/view_rays.h"
#include "shadowmap/gl_pages.h"
#include "tools/frame_json.h"
#include "tools/view_observer.h"
#include "tools/view_overlay.h"
#include "tools/view_pixel.h"
#include "tools/view_save.h"
#include "tools/view_truth.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <utility>

namespace shadowdag {

namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// As toneMap, on all threads.
std::vector<glm::vec3> displayed(const std::vector<glm::vec3>& linear, float exposure) {
    std::vector<glm::vec3> display(linear.size());
    cpuParallelRanges(linear.size(), 4096, [&](size_t begin, size_t end) {
        const std::vector<glm::vec3> part =
            toneMap({linear.begin() + ptrdiff_t(begin), linear.begin() + ptrdiff_t(end)}, exposure);
        std::copy(part.begin(), part.end(), display.begin() + ptrdiff_t(begin));
    });
    return display;
}

std::vector<uint8_t> bytesOf(const std::vector<glm::vec3>& display) {
    std::vector<uint8_t> rgba(display.size() * 4);
    cpuParallelRanges(display.size(), 4096, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            for (int c = 0; c < 3; ++c)
                rgba[4 * i + size_t(c)] =
                    uint8_t(255.0f * std::clamp(display[i][c], 0.0f, 1.0f) + 0.5f);
            rgba[4 * i + 3] = 255;
        }
    });
    return rgba;
}

bool isTruth(const ViewSide& side) {
    return side.method == "embree";
}

/// Returns the options that a side of a request is rendered with at a scale: what maps are asked
/// for goes with the pixels of the whole picture, so a smaller one is undersampled by less.
FrameOptions optionsOf(const ViewRequest& request, const ViewSide& side, float scale) {
    FrameOptions options = request.options;
    const auto scaled = [&](uint32_t full) {
        return std::max(16u, uint32_t(std::lround(double(full) * double(scale))));
    };
    options.width = scaled(request.options.width);
    options.height = scaled(request.options.height);
    options.undersample *= float(double(options.width) / double(request.options.width));
    options.rays.kind = side.method == "dag-exact" ? RayKind::kExact : RayKind::kVoxels;
    options.recordPairs = (!request.isMoving && request.wantsError) ||
                          request.overlay == ViewOverlay::kMethods || needsTruth(request.overlay);
    return options;
}

} // namespace

/// The scene that is open, with all that outlives a picture.
struct ViewRenderer::Open {
    uint64_t serial = 0;
    LoadedScene scene;
    std::string cameraText; ///< of the first view
    std::string assetPath;
    std::unique_ptr<Dag> dag; ///< where renderers find it, whoever owns it
    std::array<std::unique_ptr<FrameRenderer>, 2> renderers; ///< by side; share the scene
    std::unique_ptr<FrameRenderer> observer;                 ///< of frozen views
    std::unique_ptr<Truth> truth;                            ///< null until asked for
    bool isTruthOld = false;                                 ///< something moved since
    std::map<std::string, std::unique_ptr<CostModel>> models;
    uint32_t frame = 0;
    float exposure = 0; ///< 0: not found yet
    FrameCamera placed{"auto"};

    /// Makes the renderers over a DAG, then takes it over; what was there stays when that throws.
    void makeRenderers(Backend backend, std::unique_ptr<Dag> ofDag) {
        const Dag& read = ofDag ? *ofDag : *dag;
        auto first = std::make_unique<FrameRenderer>(backend, *scene.world, read);
        auto second = first->shareScene();
        auto third = first->shareScene();
        observer = std::move(third);
        renderers[1] = std::move(second);
        renderers[0] = std::move(first);
        if (ofDag)
            dag = std::move(ofDag);
    }
    Truth& truthNow() {
        if (!truth)
            truth = std::make_unique<Truth>(*scene.world);
        else if (isTruthOld)
            truth->update(*scene.world);
        isTruthOld = false;
        return *truth;
    }
    /// Returns the model of a side. Throws Error kUsage for one that is none, or that needs costs
    /// which there are not.
    CostModel& model(const ViewSide& side, const CostSource& costs) {
        const std::string text = side.method == "maps"     ? "texels:0"
                                 : side.method == "hybrid" ? side.model
                                                           : "texels:inf";
        std::unique_ptr<CostModel>& kept = models[text];
        if (!kept) {
            std::unique_ptr<CostModel> made = makeCostModel(text);
            giveCalibration(*made, costs);
            kept = std::move(made);
        }
        return *kept;
    }
    Camera camera(const std::string& text) {
        // One that is placed stays: it would jump with what moves, and takes a second to place.
        if (text == "auto" || (text.empty() && scene.world->cameras().empty()))
            return placed.at(*scene.world);
        return chooseCamera(*scene.world, text);
    }
};

/// The picture that is shown: what refining it and drawing it anew needs.
struct ViewRenderer::Shown {
    ViewRequest request;
    float scale = 1;
    Camera camera, look; ///< of the frame, of the picture
    std::array<FrameOptions, 2> options;
    std::array<FrameResult, 2> frames; ///< of the sides by a method
    std::array<double, 2> truthMs{};
    PairList truthPairs; ///< where no side recorded them
    const PairList* pairs = nullptr;
    GBufferView gbuffer;
    TruthRefinement refinement;
    bool asksTruth = false;
    std::array<ViewErrors, 2> errors;
    /// What does not change as the truth is refined, once it is drawn.
    struct Drawn {
        std::vector<uint8_t> rgba;
        ViewLegend legend;
    };
    std::array<Drawn, 2> drawn;
    UnfoldedMap map;
    std::optional<PixelReport> pixel;
    Clock::time_point start;

    bool shows(size_t side) const { return side == 0 || request.isSplit; }
    /// Returns whether a side's picture is the same until the next request.
    bool staysAsItIs(size_t side) const {
        return request.overlay == ViewOverlay::kVoxels ||
               (!isTruth(request.sides[side]) && !needsTruth(request.overlay));
    }
    bool hasErrors(size_t side) const {
        return asksTruth && shows(side) && !isTruth(request.sides[side]) && pairs != nullptr &&
               frames[side].visibility.size() == pairs->count();
    }
};

ViewRenderer::ViewRenderer(ViewSettings settings) : settings_(std::move(settings)) {}
ViewRenderer::~ViewRenderer() = default;

ViewSceneInfo ViewRenderer::open(const std::string& scene, const std::string& camera,
                                 uint32_t resolutionLog2, const std::string& assetPath,
                                 const Console& console) {
    const Experiment& e = settings_.experiment;
    auto opened = std::make_unique<Open>();
    opened->scene = loadSceneAndWorld(scene, e.lightCount, e.lightSeed, true, console);
    opened->cameraText = camera;
    opened->camera(camera); // a name that is not there is told before the voxels are built
    giveVoxels(*opened, resolutionLog2, assetPath, console);
    opened->serial = ++sceneCount_;
    shown_.reset();
    open_ = std::move(opened);
    return infoOf(*open_);
}

ViewSceneInfo ViewRenderer::setVoxels(uint32_t resolutionLog2, const std::string& assetPath,
                                      const Console& console) {
    shown_.reset();
    giveVoxels(*open_, resolutionLog2, assetPath, console);
    return infoOf(*open_);
}

void ViewRenderer::giveVoxels(Open& open, uint32_t resolutionLog2, const std::string& assetPath,
                              const Console& console) {
    VoxelSource source{{}, settings_.cacheDirectory, settings_.allowStale};
    if (!assetPath.empty())
        source.assetPaths.push_back(assetPath);
    auto dag = std::make_unique<Dag>(
        std::move(obtainDags(open.scene, {resolutionLog2}, source, console).front()));
    open.makeRenderers(settings_.backend, std::move(dag));
    open.assetPath = assetPath;
}

ViewSceneInfo ViewRenderer::infoOf(Open& open) const {
    const World& world = *open.scene.world;
    ViewSceneInfo info;
    info.serial = open.serial;
    info.argument = open.scene.argument;
    info.triangleCount = world.triangles().count();
    info.voxelResolution = open.dag->isBuilt() ? open.dag->grid.resolution() : 0;
    info.voxelBytes = open.dag->words.size() * sizeof(uint32_t);
    info.lights = world.lights();
    // Of several with one name --camera finds the first; numbers and "auto" mean something else.
    for (const std::string& name : cameraNames(world))
        if (!name.empty() && name != "auto" && name.find(',') == std::string::npos &&
            std::find(info.cameras.begin(), info.cameras.end(), name) == info.cameras.end())
            info.cameras.push_back(name);
    info.cameraText = open.cameraText;
    info.camera = open.camera(open.cameraText);
    info.isPlaced =
        open.cameraText == "auto" || (open.cameraText.empty() && world.cameras().empty());
    info.bounds = world.boundsWorld();
    info.frameCount =
        uint32_t(std::floor(double(world.scene().durationSeconds()) * settings_.experiment.fps)) +
        1;
    return info;
}

void ViewRenderer::setBackend(Backend backend) {
    shown_.reset();
    if (open_)
        open_->makeRenderers(backend, nullptr);
    settings_.backend = backend;
}

void ViewRenderer::moveTo(uint32_t frame) {
    Open& o = *open_;
    if (frame == o.frame)
        return;
    const std::vector<uint32_t> moved =
        o.scene.world->setTime(settings_.experiment.timeOfFrame(frame));
    o.renderers[0]->worldChanged(moved); // for all that share the scene
    o.isTruthOld = o.isTruthOld || !moved.empty();
    o.frame = frame;
}

void ViewRenderer::renderSide(size_t side) {
    Open& o = *open_;
    Shown& s = *shown_;
    const ViewSide& asked = s.request.sides[side];
    if (isTruth(asked))
        return;
    refuseStaleExact(asked.method == "dag-exact", settings_.allowStale);
    CostModel& model = o.model(asked, settings_.costs);
    FrameRenderer& renderer = *o.renderers[side];
    if (model.needsCosts())
        model.setCosts(settings_.costs.table
                           ? findCosts(*settings_.costs.table, settings_.costs.path, o.scene.name,
                                       s.request.frame)
                           : renderer.measureCosts(s.camera, s.options[side], 1));
    s.frames[side] = renderer.render(s.camera, model, s.options[side]);
}

std::shared_ptr<ViewPicture> ViewRenderer::render(const ViewRequest& asked, float scale) {
    const Clock::time_point start = Clock::now();
    ViewRequest request = asked;
    // Sparse textures have the device's pages: what is drawn is what is told and saved.
    if (settings_.backend == Backend::kGl &&
        chooseGlPages(askedGlPages(), glDeviceInfo()) == GlPages::kSparse)
        request.options.maps.pageTexels = glDeviceInfo().sparsePageTexels;
    Open& o = *open_;
    // A model that is none leaves the picture before as it is, to be refined on.
    for (size_t side = 0; side < (request.isSplit ? 2u : 1u); ++side)
        if (!isTruth(request.sides[side]))
            o.model(request.sides[side], settings_.costs);
    shown_.reset(); // whatever throws from here on leaves nothing to refine
    moveTo(request.frame);
    // What rests stands for itself, as the frames of compare do: nothing is held from pictures that
    // moved, at other sizes.
    if (!request.isMoving)
        for (const auto& renderer : o.renderers)
            renderer->reset();
    auto made = std::make_unique<Shown>();
    made->request = request;
    made->scale = scale;
    made->start = start;
    made->look = o.camera(request.camera);
    made->camera = request.frozen.empty() ? made->look : o.camera(request.frozen);
    for (size_t side = 0; side < 2; ++side)
        made->options[side] = optionsOf(request, request.sides[side], scale);
    shown_ = std::move(made);
    Shown& s = *shown_;
    try {
        bool showsTruth = false;
        for (size_t side = 0; side < 2; ++side)
            if (s.shows(side)) {
                renderSide(side);
                showsTruth = showsTruth || isTruth(request.sides[side]);
            }
        s.asksTruth =
            showsTruth || needsTruth(request.overlay) || (request.wantsError && !request.isMoving);
        if (s.asksTruth) {
            size_t from = 2; // a side that recorded its pairs
            for (size_t side = 0; side < 2; ++side)
                if (s.shows(side) && !s.frames[side].pairs.sampleStart.empty())
                    from = side;
            if (from < 2) {
                s.pairs = &s.frames[from].pairs;
            } else {
                from = isTruth(request.sides[0]) ? 0 : 1;
                s.truthPairs = o.renderers[from]->listPairs(s.camera, s.options[from]);
                s.pairs = &s.truthPairs;
            }
            s.gbuffer = o.renderers[from]->gbuffer();
            s.refinement = TruthRefinement(s.gbuffer, o.scene.world->lights(), *s.pairs);
            if (request.isMoving) {
                const Clock::time_point asked = Clock::now();
                s.refinement.finish(o.truthNow());
                s.truthMs.fill(since(asked));
                std::vector<uint32_t> all(s.gbuffer.count());
                for (size_t i = 0; i < all.size(); ++i)
                    all[i] = uint32_t(i);
                countErrors(all);
            } else {
                refine(0);
            }
        }
        if (request.pixel && !request.isMoving && request.frozen.empty())
            for (size_t side = 0; side < 2 && !s.pixel; ++side)
                if (s.shows(side) && !isTruth(request.sides[side])) {
                    const FrameOptions& options = s.options[side];
                    const auto at = [](float share, uint32_t count) {
                        return std::min(uint32_t(std::max(share, 0.0f) * float(count)), count - 1);
                    };
                    s.pixel = reportPixel(
                        *o.renderers[side], *o.scene.world, o.truthNow(), s.frames[side], options,
                        at(request.pixel->x, options.width), at(request.pixel->y, options.height));
                }
        return picture();
    } catch (...) {
        shown_.reset();
        throw;
    }
}

void ViewRenderer::close() {
    shown_.reset();
    open_.reset();
}

bool ViewRenderer::shows(uint64_t scene) const {
    return open_ && (scene == 0 || scene == open_->serial);
}

bool ViewRenderer::canRefine() const {
    return shown_ && shown_->asksTruth && !shown_->refinement.isDone();
}

bool ViewRenderer::refine(double budgetMs) {
    const Clock::time_point start = Clock::now();
    try {
        Truth& truth = open_->truthNow();
        while (canRefine()) {
            countErrors(shown_->refinement.step(truth));
            if (since(start) >= budgetMs)
                break;
        }
    } catch (...) {
        shown_.reset(); // or it would be asked again and again
        throw;
    }
    for (double& ms : shown_->truthMs)
        ms += since(start);
    return canRefine();
}

void ViewRenderer::countErrors(const std::vector<uint32_t>& samples) {
    Shown& s = *shown_;
    const std::vector<uint8_t>& truth = s.refinement.visibility();
    for (size_t side = 0; side < 2; ++side) {
        if (!s.hasErrors(side))
            continue;
        const std::vector<uint8_t>& visibility = s.frames[side].visibility;
        ViewErrors& errors = s.errors[side];
        for (const uint32_t sample : samples)
            for (uint64_t p = s.pairs->sampleStart[sample]; p < s.pairs->sampleStart[sample + 1];
                 ++p) {
                const bool isDark = visibility[p] < kHalfLit, isTrulyDark = truth[p] < kHalfLit;
                ++errors.pairCount;
                errors.falseShadowCount += isDark && !isTrulyDark;
                errors.falseLightCount += !isDark && isTrulyDark;
            }
        errors.doneShare = s.refinement.doneShare();
    }
}

std::vector<glm::vec3> ViewRenderer::truthColor() const {
    const Shown& s = *shown_;
    std::vector<glm::vec3> color =
        shadePairs(s.gbuffer, *open_->scene.world, *s.pairs, s.refinement.visibility());
    if (s.refinement.isDone())
        return color;
    std::vector<glm::vec3> filled(color.size());
    for (size_t i = 0; i < color.size(); ++i)
        filled[i] = color[s.refinement.stand(uint32_t(i))];
    return filled;
}

std::vector<glm::vec3> ViewRenderer::displayOf(size_t side, ViewPicture& picture) {
    Open& o = *open_;
    Shown& s = *shown_;
    const bool hasFrame = !isTruth(s.request.sides[side]);
    const std::vector<glm::vec3> color = hasFrame ? s.frames[side].color : truthColor();
    if (!(o.exposure > 0))
        o.exposure = autoExposure(color);
    const std::vector<glm::vec3> lit =
        displayed(color, o.exposure * std::exp2(s.request.exposureStops));
    // The truth's own side shows nothing that only a method has.
    const bool isPlain = !hasFrame && s.request.overlay != ViewOverlay::kVoxels;
    std::vector<uint8_t> truth;
    if (s.hasErrors(side)) {
        truth = s.frames[side].visibility; // right where nothing is known yet
        for (uint32_t i = 0; i < s.gbuffer.count(); ++i)
            if (s.refinement.isAnswered(i))
                std::copy(s.refinement.visibility().begin() + ptrdiff_t(s.pairs->sampleStart[i]),
                          s.refinement.visibility().begin() +
                              ptrdiff_t(s.pairs->sampleStart[i + 1]),
                          truth.begin() + ptrdiff_t(s.pairs->sampleStart[i]));
    }
    const OverlayInputs inputs{*o.renderers[side],
                               *o.scene.world,
                               s.frames[side],
                               s.options[side],
                               s.request,
                               s.camera,
                               lit,
                               truth};
    OverlayPicture drawn = isPlain ? OverlayPicture{lit, {}} : drawOverlay(inputs);
    picture.legend = drawn.legend;
    if (hasFrame && s.request.wantsMap && !s.request.isMoving && s.map.rgba.empty())
        s.map = drawUnfoldedMap(inputs);
    if (s.request.frozen.empty())
        return std::move(drawn.display);
    // The frame is the frozen camera's; the observer only looks.
    o.observer->listPairs(s.look, s.options[side]);
    const bool showsClusters = s.request.overlay == ViewOverlay::kClusters;
    const GBufferView frozen = hasFrame ? o.renderers[side]->gbuffer() : s.gbuffer;
    return drawObserved(o.observer->gbuffer(), s.look, frozen, s.camera, drawn.display,
                        showsClusters && hasFrame ? o.renderers[side]->clusters().boxesWorld
                                                  : View<const Box>{});
}

std::shared_ptr<ViewPicture> ViewRenderer::picture() {
    SDAG_ASSERT(shown_);
    Shown& s = *shown_;
    auto picture = std::make_shared<ViewPicture>();
    picture->request = s.request;
    picture->width = s.options[0].width;
    picture->height = s.options[0].height;
    picture->scale = s.scale;
    picture->camera = s.look;
    picture->lights = open_->scene.world->lights();
    picture->pixel = s.pixel;
    picture->backend = backendName(settings_.backend);
    for (size_t side = 0; side < 2; ++side) {
        if (!s.shows(side))
            continue;
        SideReport& report = picture->sides[side];
        Shown::Drawn& drawn = s.drawn[side];
        if (drawn.rgba.empty() || !s.staysAsItIs(side)) {
            ViewPicture made;
            drawn.rgba = bytesOf(displayOf(side, made));
            drawn.legend = std::move(made.legend);
        }
        report.rgba = drawn.rgba;
        if (picture->legend.title.empty()) // the left side's first
            picture->legend = drawn.legend;
        if (isTruth(s.request.sides[side])) {
            report.stages.add("embree", s.truthMs[side]);
        } else {
            report.stages = s.frames[side].stages;
            report.counts = s.frames[side].counts;
            report.maps = s.frames[side].maps;
            if (const std::string note = poolNote(report.counts); !note.empty())
                picture->notes.push_back(note);
        }
        if (s.hasErrors(side))
            report.errors = s.errors[side];
    }
    picture->mapRgba = s.map.rgba;
    picture->mapWidth = s.map.width;
    picture->mapHeight = s.map.height;
    picture->mapTitle = s.map.title;
    picture->isFinal = !canRefine() && s.scale >= 1.0f;
    picture->workMs = since(s.start);
    return picture;
}

SavedView ViewRenderer::save(const ViewRequest& asked, const std::string& directory) {
    if (!asked.frozen.empty())
        throw Error(ErrorKind::kUsage, "a frozen view is no frame of one camera; leave it (F) and "
                                       "save again");
    if (settings_.allowStale && !open_->assetPath.empty())
        throw Error(ErrorKind::kUsage, "a view with --allow-stale could not be made again from the "
                                       "scene's own voxels; open it without, and save again");
    ViewRequest request = asked;
    request.isMoving = false;
    request.wantsError = true;
    request.pixel.reset();
    Open& o = *open_;
    render(request, 1.0f);
    Shown& s = *shown_;
    std::vector<uint32_t> rest;
    for (uint32_t i = 0; i < s.gbuffer.count(); ++i)
        if (!s.refinement.isAnswered(i))
            rest.push_back(i);
    s.refinement.finish(o.truthNow());
    countErrors(rest);
    const std::shared_ptr<ViewPicture> whole = picture();

    ViewFiles files{*whole, settings_.experiment, o.scene.argument, *o.dag, {}, {}};
    for (size_t side = 0; side < 2; ++side) {
        if (!s.shows(side))
            continue;
        const bool hasFrame = !isTruth(request.sides[side]);
        std::vector<ExrChannel> channels = frameChannels(
            {side == 0 ? "" : "right.", hasFrame ? s.frames[side].color : truthColor(),
             ExrChannel::Type::kFloat, s.gbuffer, *s.pairs,
             hasFrame ? s.frames[side].visibility : s.refinement.visibility(),
             hasFrame ? s.frames[side].pairRoute : std::vector<Route>(),
             hasFrame ? s.refinement.visibility() : std::vector<uint8_t>()});
        std::move(channels.begin(), channels.end(), std::back_inserter(files.channels));
        files.picture[side] = displayOf(side, *whole);
    }
    return writeView(files, directory);
}

} // namespace shadowdag

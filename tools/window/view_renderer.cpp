// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_renderer.h"

#include "cuda/parallel_for.h"
#include "gl/context.h"
#include "hybrid/gbuffer/tone_map.h"
#include "hybrid/judge/error.h"
#include "shadowmap/gl_pages.h"
#include "tools/settings/parse.h"
#include "tools/window/view_demo.h"
#include "tools/window/view_frame.h"
#include "tools/window/view_observer.h"
#include "tools/window/view_pixel.h"
#include "tools/window/view_scene.h"
#include "tools/workspace/frame_json.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace shadowdag {

namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
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

/// Returns whether an overlay traces its own rays at every pixel: too slow for a moving picture at
/// full size.
bool tracesItself(ViewOverlay overlay) {
    return overlay == ViewOverlay::kVoxels || overlay == ViewOverlay::kSteps;
}

/// Returns whether an overlay reads the results of pairs.
bool needsPairs(ViewOverlay overlay) {
    return overlay == ViewOverlay::kMethods || needsTruth(overlay);
}

/// Returns the side of the pages that a backend has; 0: any.
uint32_t devicePageTexels(Backend backend) {
    return backend == Backend::kGl ? requestedGlPageTexels() : 0;
}

/// Returns a request in its renderable form: sparse textures have the device's pages.
ViewRequest followed(const ViewRequest& asked, Backend backend) {
    ViewRequest request = asked;
    if (const uint32_t side = devicePageTexels(backend))
        request.options.maps.pageTexels = side;
    return request;
}

/// Returns whether two requests have the same frames.
bool haveSameFrames(const ViewRequest& a, const ViewRequest& b) {
    // If the frame is a frozen camera's, the observer changes the picture alone.
    const bool hasSameCamera = a.frozen == b.frozen && (!a.frozen.empty() || a.camera == b.camera);
    return hasSameCamera && a.scene == b.scene && a.frame == b.frame && a.isSplit == b.isSplit &&
           a.sides[0] == b.sides[0] && (!a.isSplit || a.sides[1] == b.sides[1]) &&
           a.options == b.options;
}

/// Returns the options with which a side of a request is rendered at a scale. Maps have the
/// resolution of the smaller picture: maps for the larger one would cost more than the picture.
FrameOptions optionsOf(const ViewRequest& request, size_t side, float scale) {
    FrameOptions options = request.options;
    methodOf(request.sides[side].method).takeOver(options.rays);
    const auto scaled = [&](uint32_t full) {
        return std::max(16u, uint32_t(std::lround(double(full) * double(scale))));
    };
    options.width = scaled(request.options.width);
    options.height = scaled(request.options.height);
    options.recordPairs = (!request.isMoving && request.wantsError) || needsPairs(request.overlay);
    options.recordQuantities = false; // nobody reads them here
    return options;
}

/// Returns the function that frames call between stages; empty if the picture cannot be cancelled.
std::function<void()> asking(const ViewHooks& hooks) {
    if (!hooks.isUnwanted)
        return {};
    return [&hooks] {
        if (hooks.isUnwanted())
            throw PictureGivenUp{};
    };
}

void giveUpIfUnwanted(const ViewHooks& hooks) {
    if (hooks.isUnwanted && hooks.isUnwanted())
        throw PictureGivenUp{};
}

} // namespace

ViewRenderer::ViewRenderer(ViewSettings settings) : settings_(std::move(settings)) {}
ViewRenderer::~ViewRenderer() = default;

ViewSceneInfo ViewRenderer::open(const std::string& scene, const std::string& camera,
                                 uint32_t resolutionLog2, const std::string& assetPath,
                                 const Console& console) {
    const Experiment& e = settings_.experiment;
    auto opened = std::make_unique<ViewScene>(
        loadSceneAndWorld(scene, e.lightCount, e.lightSeed, true, console), settings_.backend);
    opened->cameraText = camera;
    opened->camera(camera); // an unknown name is reported before the voxels are built
    opened->giveVoxels(settings_, resolutionLog2, assetPath, console);
    opened->serial = ++sceneCount_;
    shown_.reset();
    open_ = std::move(opened);
    return open_->info(e);
}

ViewSceneInfo ViewRenderer::setVoxels(uint32_t resolutionLog2, const std::string& assetPath,
                                      const Console& console) {
    open_->giveVoxels(settings_, resolutionLog2, assetPath, console);
    shown_.reset(); // not earlier: the picture may be refined further if that throws
    return open_->info(settings_.experiment);
}

void ViewRenderer::setBackend(Backend backend) {
    if (open_)
        open_->setBackend(backend);
    shown_.reset();
    settings_.backend = backend;
}

void ViewRenderer::setCosts(CostSource costs) {
    shown_.reset();
    settings_.costs = std::move(costs);
    if (open_)
        open_->models.clear();
}

bool ViewRenderer::measures(const ViewRequest& request) {
    for (size_t side = 0; side < (request.isSplit ? 2u : 1u); ++side)
        if (!isTruth(request.sides[side]) && !settings_.costs.table &&
            open_->model(request.sides[side], settings_.costs).needsCosts())
            return true;
    return false;
}

void ViewRenderer::close() {
    shown_.reset();
    open_.reset();
}

bool ViewRenderer::shows(uint64_t scene) const {
    return open_ && (scene == 0 || scene == open_->serial);
}

const FrameCosts& ViewRenderer::costsOf(size_t side, const ViewHooks& hooks) {
    ViewScene& o = *open_;
    ViewShown& s = *shown_;
    if (settings_.costs.table) {
        const CostKey key{o.workspace.scene().name, s.request.frame};
        const std::string& path = settings_.costs.path;
        const TableCosts& found = findCosts(*settings_.costs.table, path, key);
        Experiment experiment = settings_.experiment;
        experiment.width = s.options[side].width;
        experiment.height = s.options[side].height;
        const std::string others =
            otherConditions(found, path, key,
                            costConditions(o.workspace.scene(), s.camera, experiment,
                                           experiment.timeOfFrame(s.request.frame)));
        if (!others.empty())
            s.notes.push_back("oracle: " + others);
        return found;
    }
    FrameOptions options = s.options[side];
    options.recordPairs = false; // no cost depends on it
    const std::string& camera = s.request.frozen.empty() ? s.request.camera : s.request.frozen;
    const bool isKept = o.measured && o.measured->frame == s.request.frame &&
                        o.measured->options == options && o.measured->camera == camera;
    if (!isKept) {
        if (hooks.tells)
            hooks.tells("oracle: measure what every map costs by both methods");
        const Clock::time_point start = Clock::now();
        FrameCosts costs =
            o.renderer(side, s.isWhole).measureCosts(s.camera, options, 1, asking(hooks));
        o.measured =
            MeasuredCosts{camera, s.request.frame, options, std::move(costs), since(start)};
        if (hooks.tells)
            hooks.tells("");
    }
    s.notes.push_back("oracle: the costs of " + std::to_string(o.measured->costs.maps.size()) +
                      " maps, measured in " + numberText(std::round(o.measured->tookMs) * 1e-3) +
                      " s, are kept until the view changes");
    return o.measured->costs;
}

void ViewRenderer::renderSide(size_t side, const ViewHooks& hooks) {
    ViewScene& o = *open_;
    ViewShown& s = *shown_;
    const ViewSide& asked = s.request.sides[side];
    if (isTruth(asked))
        return;
    CostModel* model = &o.model(asked, settings_.costs);
    if (model->needsCosts() && !settings_.costs.table && !s.isWhole) {
        s.notes.push_back(std::string("oracle measures once the view rests; until then ") +
                          kStandInModel + " routes");
        model = &o.model({"hybrid", kStandInModel}, settings_.costs);
    } else if (model->needsCosts()) {
        model->setCosts(costsOf(side, hooks));
    }
    s.frames[side] =
        o.renderer(side, s.isWhole).render(s.camera, *model, s.options[side], asking(hooks));
}

void ViewRenderer::startTruth() {
    ViewScene& o = *open_;
    ViewShown& s = *shown_;
    size_t from = 2; // a side that recorded its pairs
    for (size_t side = 0; side < 2; ++side)
        if (s.hasFrame(side) && !s.frames[side].pairs.sampleStart.empty())
            from = side;
    if (from < 2) {
        s.pairs = &s.frames[from].pairs;
    } else {
        from = isTruth(s.request.sides[0]) ? 0 : 1;
        s.truthPairs = o.renderer(from, s.isWhole).listPairs(s.camera, s.options[from]);
        s.pairs = &s.truthPairs;
    }
    s.gbuffer = o.renderer(from, s.isWhole).gbuffer();
    s.refinement = TruthRefinement(s.gbuffer, o.world().lights(), *s.pairs);
    if (s.isWhole) {
        refine(0);
        return;
    }
    const Clock::time_point asked = Clock::now();
    s.refinement.finish(o.workspace.truth());
    s.truthMs.fill(since(asked));
    std::vector<uint32_t> all(s.gbuffer.count());
    for (size_t i = 0; i < all.size(); ++i)
        all[i] = uint32_t(i);
    countErrors(all);
}

void ViewRenderer::reportRequestedPixel() {
    ViewScene& o = *open_;
    ViewShown& s = *shown_;
    s.pixel.reset();
    if (!s.request.pixel || s.request.isMoving || !s.request.frozen.empty())
        return;
    for (size_t side = 0; side < 2 && !s.pixel; ++side) {
        if (!s.hasFrame(side))
            continue;
        const FrameOptions& options = s.options[side];
        const auto at = [](float share, uint32_t count) {
            return std::min(uint32_t(std::max(share, 0.0f) * float(count)), count - 1);
        };
        s.pixel = reportPixel(o.renderer(side, s.isWhole), o.world(), o.workspace.truth(),
                              s.frames[side], options, at(s.request.pixel->x, options.width),
                              at(s.request.pixel->y, options.height));
    }
}

bool ViewRenderer::canRedraw(const ViewRequest& asked) const {
    const ViewRequest request = followed(asked, settings_.backend);
    return shown_ && shown_->isWhole && haveSameFrames(shown_->request, request) &&
           ((!request.wantsError && !needsPairs(request.overlay)) || shown_->hasPairs()) &&
           (!request.isMoving ||
            (!tracesItself(request.overlay) && shown_->request.camera == request.camera));
}

std::shared_ptr<ViewPicture> ViewRenderer::redraw(const ViewRequest& request,
                                                  const ViewHooks& hooks) {
    ViewShown& s = *shown_;
    const bool isOtherPixel = s.request.pixel != request.pixel;
    s.request = request;
    s.start = Clock::now();
    s.drawn = {};
    s.map = {};
    try {
        s.look = open_->camera(request.camera);
        bool showsTruth = false;
        for (size_t side = 0; side < 2; ++side)
            showsTruth = showsTruth || (s.shows(side) && isTruth(request.sides[side]));
        s.asksTruth = showsTruth || needsTruth(request.overlay) || request.wantsError;
        if (s.asksTruth && s.pairs == nullptr)
            startTruth();
        // A request made while the picture moved is reported once it rests.
        if (isOtherPixel || (request.pixel && !s.pixel))
            reportRequestedPixel();
        return picture(hooks);
    } catch (const PictureGivenUp&) {
        throw; // between sides: the frames are whole
    } catch (...) {
        shown_.reset();
        throw;
    }
}

std::shared_ptr<ViewPicture> ViewRenderer::render(const ViewRequest& asked, float scale,
                                                  const ViewHooks& hooks) {
    const Clock::time_point start = Clock::now();
    const ViewRequest request = followed(asked, settings_.backend);
    if (scale >= 1.0f && canRedraw(request))
        return redraw(request, hooks);
    ViewScene& o = *open_;
    // An invalid model leaves the previous picture, which can be refined further.
    for (size_t side = 0; side < (request.isSplit ? 2u : 1u); ++side)
        if (!isTruth(request.sides[side]))
            o.model(request.sides[side], settings_.costs);
    shown_.reset(); // an exception from here on leaves nothing to refine
    o.moveTo(request.frame, settings_.experiment);
    auto made = std::make_unique<ViewShown>();
    made->request = request;
    made->scale = scale;
    made->isWhole = !request.isMoving && scale >= 1.0f;
    // A complete picture is independent, as the frames of compare are: nothing is kept from earlier
    // pictures, of other cameras.
    if (made->isWhole)
        for (size_t side = 0; side < 2; ++side)
            if (made->hasFrame(side))
                o.renderer(side, true).reset();
    made->start = start;
    made->look = o.camera(request.camera);
    made->camera = request.frozen.empty() ? made->look : o.camera(request.frozen);
    for (size_t side = 0; side < 2; ++side)
        made->options[side] = optionsOf(request, side, scale);
    shown_ = std::move(made);
    ViewShown& s = *shown_;
    try {
        bool showsTruth = false;
        for (size_t side = 0; side < 2; ++side)
            if (s.shows(side)) {
                renderSide(side, hooks);
                showsTruth = showsTruth || isTruth(request.sides[side]);
            }
        giveUpIfUnwanted(hooks);
        s.asksTruth =
            showsTruth || needsTruth(request.overlay) || (request.wantsError && !request.isMoving);
        if (s.asksTruth)
            startTruth();
        giveUpIfUnwanted(hooks);
        reportRequestedPixel();
        return picture(hooks);
    } catch (...) {
        shown_.reset();
        throw;
    }
}

bool ViewRenderer::hasPicture() const {
    return shown_ != nullptr;
}

bool ViewRenderer::canRefine() const {
    return shown_ && shown_->asksTruth && !shown_->refinement.isDone();
}

bool ViewRenderer::refine(double budgetMs) {
    const Clock::time_point start = Clock::now();
    try {
        const Truth& truth = open_->workspace.truth();
        while (canRefine()) {
            countErrors(shown_->refinement.step(truth));
            if (since(start) >= budgetMs)
                break;
        }
    } catch (...) {
        shown_.reset(); // otherwise it would be requested repeatedly
        throw;
    }
    for (double& ms : shown_->truthMs)
        ms += since(start);
    return canRefine();
}

void ViewRenderer::countErrors(const std::vector<uint32_t>& samples) {
    ViewShown& s = *shown_;
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
    const ViewShown& s = *shown_;
    std::vector<glm::vec3> color =
        shadePairs(s.gbuffer, open_->world(), *s.pairs, s.refinement.visibility());
    if (s.refinement.isDone())
        return color;
    std::vector<glm::vec3> filled(color.size());
    for (size_t i = 0; i < color.size(); ++i)
        filled[i] = color[s.refinement.stand(uint32_t(i))];
    return filled;
}

float ViewRenderer::exposure() const {
    // At most the limit of experiments, so that a saved one can be read.
    return float(std::min(
        double(open_->exposure) * std::exp2(double(shown_->request.exposureStops)), kMaxExposure));
}

std::vector<glm::vec3> ViewRenderer::displayOf(size_t side, ViewLegend& legend) {
    ViewScene& o = *open_;
    ViewShown& s = *shown_;
    const bool hasFrame = s.hasFrame(side);
    const std::vector<glm::vec3> color = hasFrame ? s.frames[side].color : truthColor();
    if (!(o.exposure > 0))
        o.exposure = settings_.experiment.exposureOf(color);
    const std::vector<glm::vec3> lit = toneMap(color, exposure());
    // The truth's own side shows none of the data that only a method has.
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
    const OverlayInputs inputs{o.renderer(side, s.isWhole),
                               o.world(),
                               s.frames[side],
                               s.options[side],
                               s.request,
                               s.camera,
                               lit,
                               truth};
    OverlayPicture drawn = isPlain ? OverlayPicture{lit, {}} : drawOverlay(inputs);
    legend = std::move(drawn.legend);
    if (hasFrame && s.request.wantsMap && !s.request.isMoving && s.map.rgba.empty())
        s.map = drawUnfoldedMap(inputs);
    if (s.request.frozen.empty())
        return std::move(drawn.display);
    // The frame is the frozen camera's; the observer only displays it.
    FrameRenderer& observer = o.observer();
    observer.listPairs(s.look, s.options[side]);
    const bool showsClusters = s.request.overlay == ViewOverlay::kClusters;
    const GBufferView frozen = hasFrame ? o.renderer(side, s.isWhole).gbuffer() : s.gbuffer;
    return drawObserved(observer.gbuffer(), s.look, frozen, s.camera, drawn.display,
                        showsClusters && hasFrame
                            ? o.renderer(side, s.isWhole).clusters().boxesWorld
                            : View<const Box>{});
}

std::shared_ptr<ViewPicture> ViewRenderer::picture(const ViewHooks& hooks) {
    SDAG_ASSERT(shown_);
    ViewShown& s = *shown_;
    auto picture = std::make_shared<ViewPicture>();
    picture->request = s.request;
    picture->width = s.options[0].width;
    picture->height = s.options[0].height;
    picture->scale = s.scale;
    picture->camera = s.look;
    picture->lights = open_->world().lights();
    picture->pixel = s.pixel;
    picture->backend = backendName(settings_.backend);
    picture->devicePageTexels = devicePageTexels(settings_.backend);
    picture->notes = s.notes;
    if (s.request.wantsTour) {
        if (open_->tour.empty()) {
            if (hooks.tells)
                hooks.tells("demo: find views");
            open_->tour = findTour(open_->world(), open_->workspace.truth());
            if (open_->tour.empty())
                open_->tour.push_back({s.look, false});
        }
        picture->tour = open_->tour;
    }
    for (size_t side = 0; side < 2; ++side) {
        if (!s.shows(side))
            continue;
        SideReport& report = picture->sides[side];
        ViewShown::Drawn& drawn = s.drawn[side];
        if (drawn.rgba.empty() || !s.staysAsItIs(side)) {
            giveUpIfUnwanted(hooks);
            drawn.rgba = bytesOf(displayOf(side, drawn.legend));
        }
        report.rgba = drawn.rgba;
        if (picture->legend.title.empty()) // the left side's first
            picture->legend = drawn.legend;
        if (isTruth(s.request.sides[side])) {
            report.stages.add("truth", s.truthMs[side]);
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
    picture->isFinal = !canRefine() && s.isWhole && !s.request.isMoving;
    picture->workMs = since(s.start);
    return picture;
}

} // namespace shadowdag

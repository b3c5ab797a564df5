// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_session.h"

#include "tools/settings/console.h"
#include "tools/settings/provenance.h"
#include "tools/settings/words.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <new>
#include <utility>

namespace shadowdag {

namespace {

/// Thrown through any work when the window closes or another scene is requested.
struct GivenUp {};

/// How often the truth's picture is redrawn while it is refined.
constexpr double kRefinedPictureMs = 60;

/// A complete picture that takes longer is preceded by one at full size whose maps are kept from
/// the moving pictures.
constexpr double kSlowPictureMs = 500;

/// Returns whether a visible side of a request draws maps.
bool drawsMaps(const ViewRequest& request) {
    for (size_t side = 0; side < (request.isSplit ? 2u : 1u); ++side)
        if (methodOf(request.sides[side].method).needs().maps)
            return true;
    return false;
}

/// Gives priority to the window's own thread; otherwise the worker's threads take all cores.
void stepBack() {
    // For this thread and those that it starts. A refusal changes no result. At lower priorities
    // the window is not drawn better, and the worker hardly runs beside other programs.
    if (setpriority(PRIO_PROCESS, id_t(gettid()), 5) != 0)
        return;
}

} // namespace

ViewSession::ViewSession(ViewSettings settings, double targetMs, std::function<void()> wake)
    : renderer_(std::move(settings)), scale_(targetMs), wake_(std::move(wake)),
      thread_([this] { run(); }) {}

ViewSession::~ViewSession() {
    {
        const std::lock_guard lock(mutex_);
        isQuitting_ = true;
    }
    asked_.notify_all();
    thread_.join();
}

void ViewSession::open(const std::string& scene, const std::string& camera, uint32_t resolutionLog2,
                       const std::string& assetPath) {
    {
        const std::lock_guard lock(mutex_);
        // Voxels for a scene that is not open yet are dropped with it; opening starts over.
        const std::optional<OpenWork>& before = work_.open ? work_.open : opening_;
        OpenWork next{scene, camera, resolutionLog2, assetPath};
        if (scene.empty() && before) {
            next.scene = before->scene;
            next.camera = before->camera;
        }
        work_.open = std::move(next);
    }
    asked_.notify_all();
}

void ViewSession::setBackend(const std::string& name) {
    {
        const std::lock_guard lock(mutex_);
        work_.backend = name;
    }
    asked_.notify_all();
}

void ViewSession::setCosts(const std::string& path) {
    {
        const std::lock_guard lock(mutex_);
        work_.costs = path;
    }
    asked_.notify_all();
}

void ViewSession::ask(const ViewRequest& request) {
    {
        const std::lock_guard lock(mutex_);
        work_.ask = request;
    }
    asked_.notify_all();
}

void ViewSession::save(const ViewRequest& request, const std::string& directory) {
    {
        const std::lock_guard lock(mutex_);
        const bool isAfter = work_.backend || work_.costs || work_.open;
        (isAfter ? work_.saves : work_.savesBefore).push_back({request, directory});
    }
    asked_.notify_all();
}

std::shared_ptr<const ViewPicture> ViewSession::takePicture() {
    const std::lock_guard lock(mutex_);
    return std::exchange(picture_, nullptr);
}

bool ViewSession::hasPicture() const {
    const std::lock_guard lock(mutex_);
    return picture_ != nullptr;
}

std::optional<ViewSceneInfo> ViewSession::takeScene() {
    const std::lock_guard lock(mutex_);
    return std::exchange(scene_, std::nullopt);
}

std::optional<SavedView> ViewSession::takeSaved() {
    const std::lock_guard lock(mutex_);
    return std::exchange(saved_, std::nullopt);
}

std::optional<TakenCosts> ViewSession::takeCosts() {
    const std::lock_guard lock(mutex_);
    return std::exchange(costs_, std::nullopt);
}

ViewStatus ViewSession::status() const {
    const std::lock_guard lock(mutex_);
    ViewStatus status = status_;
    for (const auto& [kind, error] : errors_)
        status.error += (status.error.empty() ? "" : "\n") + error;
    status.failedSaveCount = failedSaveCount_;
    return status;
}

void ViewSession::clearErrors() {
    const std::lock_guard lock(mutex_);
    errors_.clear();
}

bool ViewSession::isBusy() const {
    const std::lock_guard lock(mutex_);
    return isBusy_ && !work_.ask;
}

bool ViewSession::isIdle() const {
    const std::lock_guard lock(mutex_);
    return !isWorking_ && !canRefine_ && !work_.any();
}

void ViewSession::report(const std::string& what, double fraction) {
    {
        const std::lock_guard lock(mutex_);
        if (isQuitting_ || work_.open)
            throw GivenUp{};
        status_.work = what;
        status_.fraction = fraction;
    }
    checkInterrupted();
    if (wake_)
        wake_();
}

ViewHooks ViewSession::hooks(bool givesWay) {
    return {[this, givesWay] {
                const std::lock_guard lock(mutex_);
                return isQuitting_ || (givesWay && work_.endsPicture());
            },
            [this](const std::string& work) {
                {
                    const std::lock_guard lock(mutex_);
                    status_.work = work;
                    status_.fraction = -1;
                }
                if (wake_)
                    wake_();
            }};
}

Console ViewSession::console() {
    return Console(Console::Listener{
        [this](const std::string& text) {
            const std::lock_guard lock(mutex_);
            status_.notes.push_back(text);
        },
        [this](const std::string& what, double fraction) { report(what, fraction); }});
}

void ViewSession::publish(std::shared_ptr<const ViewPicture> picture) {
    isUnshown_ = false;
    {
        const std::lock_guard lock(mutex_);
        picture_ = std::move(picture);
        isBusy_ = false;
    }
    if (wake_)
        wake_();
}

template <class F> void ViewSession::attempt(const char* kind, const F& step) {
    std::string error;
    try {
        step();
    } catch (const GivenUp&) {
    } catch (const PictureGivenUp&) {
    } catch (const Interrupted&) { // the window sees it as well
    } catch (const std::bad_alloc&) {
        error = "not enough memory; try fewer voxels, a smaller window or a smaller pool";
    } catch (const std::exception& thrown) {
        error = thrown.what();
    }
    const std::lock_guard lock(mutex_);
    if (error.empty())
        errors_.erase(kind);
    else
        errors_[kind] = error;
}

void ViewSession::openScene(const OpenWork& work) {
    report(work.scene.empty() ? "voxels" : "open " + work.scene, 0);
    if (work.scene.empty() && !renderer_.isOpen())
        throw Error(ErrorKind::kUsage, "voxels need their scene; open the scene first");
    ViewSceneInfo info = work.scene.empty()
                             ? renderer_.setVoxels(work.resolutionLog2, work.assetPath, console())
                             : renderer_.open(work.scene, work.camera, work.resolutionLog2,
                                              work.assetPath, console());
    scale_.reset();
    wholeMs_ = 0;
    const std::lock_guard lock(mutex_);
    scene_ = std::move(info);
}

void ViewSession::answer(const ViewRequest& request) {
    if (!renderer_.shows(request.scene))
        return; // of a scene that is no longer open
    const ViewHooks closing = hooks(false);
    if (renderer_.canRedraw(request)) {
        if (!request.isMoving)
            return computeAllPairs(request, 1.0f);
        publish(renderer_.render(request, 1.0f, closing));
        return;
    }
    const float scale = scale_.next();
    if (!request.isMoving && scale >= 1.0f && !renderer_.measures(request)) {
        // Nothing of it was shown yet: if it were cancelled, a continuous series of requests would
        // show nothing. It takes no longer than a moving picture, as far as is known.
        std::shared_ptr<ViewPicture> picture = renderer_.render(request, 1.0f, closing);
        scale_.note(1.0f, picture->workMs);
        publish(std::move(picture));
        return;
    }
    ViewRequest quick = request; // a resting picture is shown small first
    quick.isMoving = true;
    std::shared_ptr<ViewPicture> picture = renderer_.render(quick, scale, closing);
    scale_.note(scale, picture->workMs);
    picture->request.isMoving = request.isMoving;
    picture->isFinal = false;
    publish(std::move(picture));
    const bool isSlow = wholeMs_ == 0 || wholeMs_ > kSlowPictureMs;
    if (!request.isMoving)
        computeAllPairs(request, isSlow && drawsMaps(request) ? scale : 1.0f);
}

void ViewSession::computeAllPairs(const ViewRequest& request, float mapScale) {
    try {
        const ViewHooks ours = hooks(true);
        if (!ours.isUnwanted()) {
            if (mapScale < 1.0f) {
                ViewRequest kept = request;
                kept.isMoving = true;
                kept.options.undersample /= mapScale;
                std::shared_ptr<ViewPicture> picture = renderer_.render(kept, 1.0f, ours);
                picture->request = request;
                picture->mapScale = mapScale;
                picture->isFinal = false;
                publish(std::move(picture));
            }
            const bool isAnew = !renderer_.canRedraw(request);
            std::shared_ptr<ViewPicture> picture = renderer_.render(request, 1.0f, ours);
            if (isAnew)
                wholeMs_ = picture->workMs;
            publish(std::move(picture));
            return;
        }
    } catch (const PictureGivenUp&) {
    }
    const std::lock_guard lock(mutex_);
    if (!work_.ask) // the requested work first; then this, if it is still the newest
        work_.ask = request;
}

void ViewSession::saveAll(const std::vector<SaveWork>& saves) {
    for (const SaveWork& save : saves) {
        bool isDone = false;
        attempt("save", [&] {
            if (!renderer_.shows(save.request.scene))
                throw Error(ErrorKind::kUsage, "nothing to save: no scene is open yet");
            SavedView saved = renderer_.save(save.request, save.directory, hooks(false));
            isDone = true;
            const std::lock_guard lock(mutex_);
            saved_ = std::move(saved);
        });
        const std::lock_guard lock(mutex_);
        failedSaveCount_ += isDone ? 0 : 1;
        lostSaveCount_ += isQuitting_ && !isDone ? 1 : 0;
    }
}

void ViewSession::doWork(const Work& work) {
    // A failure does not affect the rest: the previous scene is still open.
    saveAll(work.savesBefore);
    if (work.backend)
        attempt("backend", [&] {
            renderer_.setBackend(chooseBackend(*work.backend));
            scale_.reset();
            wholeMs_ = 0;
        });
    if (work.costs)
        attempt("costs", [&] {
            CostSource costs = readCostSource(*work.costs, buildProvenance(renderer_.backend()));
            TakenCosts taken{costs.path, costs.otherMachine};
            renderer_.setCosts(std::move(costs));
            const std::lock_guard lock(mutex_);
            costs_ = std::move(taken);
        });
    if (work.open) {
        attempt("open", [&] { openScene(*work.open); });
        const std::lock_guard lock(mutex_);
        opening_.reset();
    }
    saveAll(work.saves);
    if (work.ask && renderer_.isOpen())
        attempt("picture", [&] { answer(*work.ask); });
}

bool ViewSession::hasNewWork() const {
    const std::lock_guard lock(mutex_);
    return isQuitting_ || work_.any();
}

void ViewSession::refine() {
    // In short steps, so that requests do not wait; drawn as often as drawing takes no more than a
    // third.
    const auto start = std::chrono::steady_clock::now();
    const auto spent = [&] {
        return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
            .count();
    };
    while (renderer_.canRefine() && renderer_.refine(0) &&
           spent() < std::max(kRefinedPictureMs, 2.0 * drawnMs_))
        if (hasNewWork())
            return;
    const double asked = spent();
    try {
        publish(renderer_.picture(hooks(true)));
        drawnMs_ = spent() - asked;
    } catch (const PictureGivenUp&) {
        isUnshown_ = true; // if the work that it gave way to fails
    }
}

void ViewSession::run() {
    stepBack();
    while (true) {
        Work work;
        bool isRefining = false;
        {
            std::unique_lock lock(mutex_);
            isUnshown_ = isUnshown_ && renderer_.hasPicture();
            canRefine_ = renderer_.canRefine() || isUnshown_;
            isWorking_ = isBusy_ = false;
            asked_.wait(lock, [&] { return isQuitting_ || work_.any() || canRefine_; });
            if (isQuitting_) {
                lostSaveCount_ += work_.savesBefore.size() + work_.saves.size();
                break;
            }
            work = std::exchange(work_, Work{});
            isRefining = !work.any();
            isWorking_ = true;
            isBusy_ = work.ask.has_value();
            if (work.open) {
                opening_ = work.open;
                status_.notes.clear();
            }
        }
        if (isRefining)
            attempt("picture", [&] { refine(); });
        else
            doWork(work);
        {
            const std::lock_guard lock(mutex_);
            status_.work.clear();
        }
        if (wake_)
            wake_();
    }
    if (lostSaveCount_ > 0)
        Console(false).note("shadowdag: warning: the window was closed before " +
                            countText(lostSaveCount_, "view") + " could be saved");
    renderer_.close(); // here, where its contexts are: OpenGL's belong to a thread
}

} // namespace shadowdag

// SPDX-License-Identifier: Apache-2.0
// The window's worker: a thread that opens scenes, renders and refines while the window stays
// responsive.
#pragma once

#include "tools/window/view_renderer.h"
#include "tools/window/view_scale.h"

#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace shadowdag {

/// The state of the worker, for the window's status line.
struct ViewStatus {
    std::string work;    ///< "voxelize atrium 1024^3"; "" without long work
    double fraction = 0; ///< of it; below 0: unknown
    /// Errors, one line each for opening, saving, the backend and the picture; each stays until the
    /// same operation succeeds, or until clearErrors().
    std::string error;
    std::vector<std::string> notes; ///< remarks of opening the scene
    size_t failedSaveCount = 0;     ///< views that were requested and not saved, for any reason
};

/// Costs used for routing from now on.
struct TakenCosts {
    std::string path, otherMachine; ///< as CostSource has them
};

/// Thread safe. Pictures, scenes and files come back through the functions that take them.
class ViewSession {
public:
    /// @param wake is called from the worker's thread whenever something has changed; may be empty
    /// @param targetMs the time limit of a moving picture
    ViewSession(ViewSettings settings, double targetMs, std::function<void()> wake);
    /// Cancels the current work, at its next report of progress or, for a picture, between two
    /// stages, and waits for that. Work that reports no progress (reading a file, building batches,
    /// computing the truth for a view's files) is finished first.
    ~ViewSession();

    /// Opens a scene or, if `scene` is empty, other voxels of the open one; the newest request
    /// counts.
    /// @param camera of a scene's first view, as --camera takes it
    void open(const std::string& scene, const std::string& camera, uint32_t resolutionLog2,
              const std::string& assetPath);
    /// Switches to another backend, by its name (chooseBackend).
    void setBackend(const std::string& name);
    /// Uses the costs of a file, as --costs names it, for routing; takeCosts() returns them once
    /// the file is read.
    void setCosts(const std::string& path);
    /// Requests a picture; the newest request counts. Without a scene there is no reply. A
    /// full-size picture that is being rendered is cancelled, between two stages.
    void ask(const ViewRequest& request);
    /// Requests a view's files, each view's. Earlier requests are done first; but of one to open,
    /// of backends and of costs the newest counts, wherever views are saved between them.
    void save(const ViewRequest& request, const std::string& directory);

    /// Return new results since the last call, else null or nothing.
    std::shared_ptr<const ViewPicture> takePicture();
    std::optional<ViewSceneInfo> takeScene();
    std::optional<SavedView> takeSaved();
    std::optional<TakenCosts> takeCosts();
    ViewStatus status() const;
    void clearErrors();

    /// Returns whether takePicture() has one to give.
    bool hasPicture() const;
    /// Returns whether a picture is being rendered of which nothing has been shown yet. A request
    /// that has not been started does not count: the next one replaces it.
    bool isBusy() const;
    /// Returns whether all requests are done, including refinement.
    bool isIdle() const;

private:
    struct OpenWork {
        std::string scene, camera;
        uint32_t resolutionLog2;
        std::string assetPath;
    };
    struct SaveWork {
        ViewRequest request;
        std::string directory;
    };
    struct Work {
        std::optional<std::string> backend, costs;
        std::optional<OpenWork> open;
        std::vector<SaveWork> savesBefore, saves; ///< before the three above, and after them
        std::optional<ViewRequest> ask;
        bool any() const {
            return backend || costs || open || !savesBefore.empty() || !saves.empty() || ask;
        }
        /// Returns whether the current picture is no longer needed.
        bool endsPicture() const { return backend || costs || open || ask; }
    };

    void run();
    void doWork(const Work& work);
    void openScene(const OpenWork& work);
    void saveAll(const std::vector<SaveWork>& saves);
    void answer(const ViewRequest& request);
    /// Renders a request at its full size.
    /// @param mapScale below 1: first with maps of fewer texels, those of the moving pictures
    void computeAllPairs(const ViewRequest& request, float mapScale);
    /// @param givesWay to requests, too, not only to the window's closing
    ViewHooks hooks(bool givesWay);
    /// Runs a step; an exception becomes the error of its kind.
    template <class F> void attempt(const char* kind, const F& step);
    void refine();
    bool hasNewWork() const;
    void publish(std::shared_ptr<const ViewPicture> picture);
    void report(const std::string& what, double fraction);
    Console console();

    ViewRenderer renderer_; // of the worker alone
    RenderScale scale_;     // of the worker alone
    bool isUnshown_ =
        false; // of the worker alone: whether the last picture has more data than were shown
    double drawnMs_ = 0; // of the worker alone: the time of drawing a refined picture
    double wholeMs_ = 0; // of the worker alone: the time of the last complete picture; 0: none
    std::function<void()> wake_;

    mutable std::mutex mutex_; // of what follows
    std::condition_variable asked_;
    bool isQuitting_ = false;
    size_t failedSaveCount_ = 0; ///< see ViewStatus
    size_t lostSaveCount_ = 0; ///< views whose saving the end of the window cut off
    Work work_;
    bool isWorking_ = false, isBusy_ = false, canRefine_ = false;
    ViewStatus status_;                         // without errors
    std::map<std::string, std::string> errors_; // by kind of work
    std::optional<OpenWork> opening_;           // what is being opened
    std::shared_ptr<const ViewPicture> picture_;
    std::optional<ViewSceneInfo> scene_;
    std::optional<SavedView> saved_;
    std::optional<TakenCosts> costs_;

    std::thread thread_; // last: starts when all else is there
};

} // namespace shadowdag

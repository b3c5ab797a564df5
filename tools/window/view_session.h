// SPDX-License-Identifier: Apache-2.0
// The window's worker: one thread that opens scenes, renders and refines, while the window goes on.
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

/// What the worker is about, for the window's status line.
struct ViewStatus {
    std::string work;    ///< "voxelize atrium 1024^3"; "" while nothing long is done
    double fraction = 0; ///< of it; below 0: not known
    /// What went wrong, a line each for opening, saving, the backend and the picture; each stays
    /// until the same goes well, or clearErrors().
    std::string error;
    std::vector<std::string> notes; ///< remarks of opening the scene
};

/// Costs that models route by from now on.
struct TakenCosts {
    std::string path, otherMachine; ///< as CostSource has them
};

/// Thread safe. Pictures, scenes and files come back through the functions that take them.
class ViewSession {
public:
    /// @param wake is called from the worker's thread whenever something has changed; may be empty
    /// @param targetMs what a moving picture may take
    ViewSession(ViewSettings settings, double targetMs, std::function<void()> wake);
    /// Gives up what is being done, at its next report of progress or, of a picture, between two
    /// stages, and waits for that. Work that reports none (reading a file, building batches, asking
    /// the truth for a view's files) is finished first.
    ~ViewSession();

    /// Opens a scene, or gives the open one other voxels where `scene` is empty; the newest counts.
    /// @param camera of a scene's first view, as --camera takes it
    void open(const std::string& scene, const std::string& camera, uint32_t resolutionLog2,
              const std::string& assetPath);
    /// Renders on another backend from now on, by its name (chooseBackend).
    void setBackend(const std::string& name);
    /// Routes by the costs of a file from now on, as --costs names it; takeCosts() tells once it is
    /// read.
    void setCosts(const std::string& path);
    /// Asks for a picture; the newest counts. Without a scene nothing comes. A full-size picture
    /// that is being made is given up for it, between two stages.
    void ask(const ViewRequest& request);
    /// Asks for a view's files, after everything asked before.
    void save(const ViewRequest& request, const std::string& directory);

    /// Return what is new since the last call, else null or nothing.
    std::shared_ptr<const ViewPicture> takePicture();
    std::optional<ViewSceneInfo> takeScene();
    std::optional<SavedView> takeSaved();
    std::optional<TakenCosts> takeCosts();
    ViewStatus status() const;
    void clearErrors();

    /// Returns whether takePicture() has one to give.
    bool hasPicture() const;
    /// Returns whether a picture is being made of which nothing has been shown yet. One that is
    /// asked for and not begun is not: the next takes its place.
    bool isAnswering() const;
    /// Returns whether nothing is asked for that is not done, refining included.
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
        std::optional<SaveWork> save;
        std::optional<ViewRequest> ask;
        bool any() const { return backend || costs || open || save || ask; }
        /// Returns whether the picture that is being made is of no use for it.
        bool endsPicture() const { return backend || costs || open || ask; }
    };

    void run();
    void doWork(const Work& work);
    void openScene(const OpenWork& work);
    void answer(const ViewRequest& request);
    void answerInFull(const ViewRequest& request);
    /// @param givesWay to work that is asked for, too, not only to the window's closing
    ViewHooks hooks(bool givesWay);
    /// Runs a step; what it throws becomes the error of its kind.
    template <class F> void attempt(const char* kind, const F& step);
    void refine();
    bool hasNewWork() const;
    void publish(std::shared_ptr<const ViewPicture> picture);
    void report(const std::string& what, double fraction);
    Console console();

    ViewRenderer renderer_;  // of the worker alone
    RenderScale scale_;      // of the worker alone
    bool isUnshown_ = false; // of the worker alone: the last picture knows more than was shown
    double drawnMs_ = 0;     // of the worker alone: what a refined picture took to draw
    std::function<void()> wake_;

    mutable std::mutex mutex_; // of what follows
    std::condition_variable asked_;
    bool isQuitting_ = false;
    Work work_;
    bool isWorking_ = false, isAnswering_ = false, canRefine_ = false;
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

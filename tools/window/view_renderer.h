// SPDX-License-Identifier: Apache-2.0
// The renderer of the window's worker: opens scenes, renders requests at a scale, refines the truth
// while there is no request. Not thread safe: one thread at a time.
#pragma once

#include "tools/window/view_request.h"
#include "tools/workspace/cost_file.h"
#include "tools/workspace/scene_setup.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace shadowdag {

struct ViewScene;
struct ViewShown;

/// Settings that stay the same while a window is open.
struct ViewSettings {
    Backend backend = Backend::kCpu;
    /// Lights, seed and clock as experiments have them; saved views are written over it.
    Experiment experiment;
    std::string cacheDirectory; ///< of voxel assets, as --cache
    bool allowStale = false;
    CostSource costs; ///< for models `cost` and `oracle`
};

/// The files of one saved view.
struct SavedView {
    std::string png, exr, experiment;
    std::string backend; ///< that rendered it, by its name
};

/// Thrown when a picture is no longer needed.
struct PictureGivenUp {};

/// Callbacks while a picture is rendered; each may be empty.
struct ViewHooks {
    std::function<bool()> isUnwanted; ///< called between stages
    std::function<void(const std::string& work)>
        tells; ///< announces work that takes longer than a picture
};

/// The open scene and its renderers.
class ViewRenderer {
public:
    explicit ViewRenderer(ViewSettings settings);
    ~ViewRenderer();

    /// Opens SCENE with voxels of a resolution or, if `assetPath` is not empty, of a file. Throws
    /// the exceptions of loadSceneAndWorld, chooseCamera and obtainDags; the previous scene then
    /// stays open.
    /// @param camera of the first view, as --camera takes it
    /// @param console receives progress; it may throw to cancel
    ViewSceneInfo open(const std::string& scene, const std::string& camera, uint32_t resolutionLog2,
                       const std::string& assetPath, const Console& console);
    /// Replaces the voxels of the open scene. Throws as open().
    ViewSceneInfo setVoxels(uint32_t resolutionLog2, const std::string& assetPath,
                            const Console& console);
    /// Switches to another backend; if a scene is open, its renderers are created again. If that
    /// throws, the previous backend stays.
    void setBackend(Backend backend);
    Backend backend() const { return settings_.backend; }
    /// Closes the scene and its renderers. Renderers on OpenGL must be closed on a thread that may
    /// make their context current: the one that used them, not one with a window's context.
    void close();
    bool isOpen() const { return open_ != nullptr; }
    /// Returns whether requests of a scene, by its number, are for the open one; 0 is any.
    bool shows(uint64_t scene) const;
    /// Replaces the costs used for routing.
    void setCosts(CostSource costs);

    /// Returns whether a visible side routes by costs that must be measured first.
    bool measures(const ViewRequest& request);

    /// Renders a request at a scale of its size. All sides are complete except the truth's: it is
    /// complete if the request moves; otherwise isFinal is false and refine() completes it. At a
    /// scale below 1 maps and routes are also those of the smaller picture. Costs that a model
    /// needs are measured when the picture rests at its full size, and kept until something
    /// changes; until then kStandInModel routes, and the notes report it. If canRedraw(), the
    /// frames of the last picture are drawn again. Throws the exceptions of FrameRenderer::render,
    /// and PictureGivenUp if the picture is no longer needed: then there is no last picture, unless
    /// it was only drawn again, whose frames stay.
    std::shared_ptr<ViewPicture> render(const ViewRequest& request, float scale,
                                        const ViewHooks& hooks = {});
    /// Returns whether the last picture's frames are those of a request and have enough data to
    /// draw it: it is then ready at once, at full size, with the truth computed so far.
    bool canRedraw(const ViewRequest& request) const;
    /// Computes the truth for more samples of the last picture, for about `budgetMs`. Returns
    /// whether samples remain.
    bool refine(double budgetMs);
    /// Returns whether there is a last picture.
    bool hasPicture() const;
    /// Returns whether refine() has something to do.
    bool canRefine() const;
    /// Returns the last picture again, with the results of refine() since. Throws PictureGivenUp if
    /// it is no longer needed; it can be requested again.
    std::shared_ptr<ViewPicture> picture(const ViewHooks& hooks = {});

    /// Renders a request at its full size, independently (nothing kept from frames before, the
    /// complete truth), and writes `directory`/view-NNNN.png, .exr and .experiment.json, NNNN the
    /// first number that is free. compare --experiment renders it again, with the same pairs and
    /// results; for a model that needs costs, with the same --costs (without any, oracle measures
    /// again). Throws Error kUsage for a frozen view and for voxels of another scene, kResource
    /// when a file cannot be written; files are complete or absent.
    /// Throws PictureGivenUp, before any file, if it is no longer needed; not while the truth is
    /// computed.
    SavedView save(const ViewRequest& request, const std::string& directory,
                   const ViewHooks& hooks = {});

private:
    std::shared_ptr<ViewPicture> redraw(const ViewRequest& request, const ViewHooks& hooks);
    void renderSide(size_t side, const ViewHooks& hooks);
    const FrameCosts& costsOf(size_t side, const ViewHooks& hooks);
    void startTruth();
    void reportRequestedPixel();
    void countErrors(const std::vector<uint32_t>& samples);
    std::vector<glm::vec3> truthColor() const;
    std::vector<glm::vec3> displayOf(size_t side, ViewLegend& legend);
    float exposure() const;

    ViewSettings settings_;
    uint64_t sceneCount_ = 0;
    std::unique_ptr<ViewScene> open_;
    std::unique_ptr<ViewShown> shown_;
};

/// Routes while costs are not measured yet.
inline constexpr const char* kStandInModel = "texels:96";

} // namespace shadowdag

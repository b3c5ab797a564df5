// SPDX-License-Identifier: Apache-2.0
// What the window's worker runs: opens scenes, renders requests at a scale, refines the truth while
// nothing else is asked. Not thread safe: one thread at a time.
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

/// What stays the same while a window is open.
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

/// Thrown where a picture is not wanted any more.
struct PictureGivenUp {};

/// Who is asked and told while a picture is made; each may be empty.
struct ViewHooks {
    std::function<bool()> isUnwanted;                   ///< asked between stages
    std::function<void(const std::string& work)> tells; ///< what takes longer than a picture does
};

/// The scene that is open and what renders it.
class ViewRenderer {
public:
    explicit ViewRenderer(ViewSettings settings);
    ~ViewRenderer();

    /// Opens SCENE with voxels of a resolution or, where `assetPath` is not empty, of a file. The
    /// scene before stays open, as it is, when this throws, as loadSceneAndWorld, chooseCamera and
    /// obtainDags do.
    /// @param camera of the first view, as --camera takes it
    /// @param console hears what takes time; it may throw to give up
    ViewSceneInfo open(const std::string& scene, const std::string& camera, uint32_t resolutionLog2,
                       const std::string& assetPath, const Console& console);
    /// Gives the scene that is open other voxels. As open().
    ViewSceneInfo setVoxels(uint32_t resolutionLog2, const std::string& assetPath,
                            const Console& console);
    /// Renders on another backend from now on; with a scene open, its renderers are made anew.
    /// Stays with the one before where that throws.
    void setBackend(Backend backend);
    Backend backend() const { return settings_.backend; }
    /// Gives up the scene and what renders it. Renderers on OpenGL end on a thread that may make
    /// their context current: that which used them, not one that has a window's.
    void close();
    bool isOpen() const { return open_ != nullptr; }
    /// Returns whether requests of a scene, by its number, are of the one that is open; 0 is any.
    bool shows(uint64_t scene) const;
    /// Routes by other costs from now on.
    void setCosts(CostSource costs);

    /// Returns whether a side that is shown routes by costs that would be measured first.
    bool measures(const ViewRequest& request);

    /// Renders a request at a scale of its size. Every side but the truth's is whole; the truth's
    /// whole where the request moves, else what isFinal = false says is refined by refine(). At a
    /// scale below 1 the picture is one of the smaller size, in its maps and routes, too. A model
    /// whose costs are to be measured gets them where the picture rests at its full size, and keeps
    /// them until something changes; elsewhere kStandInModel routes, and the notes say so. Where
    /// canRedraw(), the frames of the last picture are drawn again. Throws what
    /// FrameRenderer::render throws, and PictureGivenUp where it is unwanted: then there is no last
    /// picture, but of one that was drawn again and given up, whose frames stay.
    std::shared_ptr<ViewPicture> render(const ViewRequest& request, float scale,
                                        const ViewHooks& hooks = {});
    /// Returns whether the last picture's frames are those of a request, and what they know is
    /// enough to draw it: it then comes at once, at full size, with the truth found so far.
    bool canRedraw(const ViewRequest& request) const;
    /// Asks the truth for more samples of the last picture, for about `budgetMs`. Returns whether
    /// there is more to ask.
    bool refine(double budgetMs);
    /// Returns whether there is a last picture.
    bool hasPicture() const;
    /// Returns whether refine() has something to do.
    bool canRefine() const;
    /// Returns the last picture anew, with what refine() found since. Throws PictureGivenUp where
    /// it is unwanted; it can be asked for again.
    std::shared_ptr<ViewPicture> picture(const ViewHooks& hooks = {});

    /// Renders a request at its full size, by itself (nothing kept from frames before, the truth
    /// asked in full), and writes `directory`/view-NNNN.png, .exr and .experiment.json, NNNN the
    /// first number that is free: what compare --experiment then renders again, the same pairs with
    /// the same answers; of a model that needs costs, with the same --costs (without any, oracle
    /// measures anew). Throws Error kUsage for a frozen view and for voxels of another scene,
    /// kResource when a file cannot be written; files are whole or not there.
    /// Throws PictureGivenUp, before any file, where it is unwanted; not while the truth is asked.
    SavedView save(const ViewRequest& request, const std::string& directory,
                   const ViewHooks& hooks = {});

private:
    std::shared_ptr<ViewPicture> redraw(const ViewRequest& request, const ViewHooks& hooks);
    void renderSide(size_t side, const ViewHooks& hooks);
    const FrameCosts& costsOf(size_t side, const ViewHooks& hooks);
    void startTruth();
    void reportPixelAsked();
    void countErrors(const std::vector<uint32_t>& samples);
    std::vector<glm::vec3> truthColor() const;
    std::vector<glm::vec3> displayOf(size_t side, ViewLegend& legend);
    float exposure() const;

    ViewSettings settings_;
    uint64_t sceneCount_ = 0;
    std::unique_ptr<ViewScene> open_;
    std::unique_ptr<ViewShown> shown_;
};

/// Routes where costs are not measured yet.
inline constexpr const char* kStandInModel = "texels:96";

} // namespace shadowdag

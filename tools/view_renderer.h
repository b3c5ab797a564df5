// SPDX-License-Identifier: Apache-2.0
// What the window's worker runs: opens scenes, renders requests at a scale, refines the truth while
// nothing else is asked. Not thread safe: one thread at a time.
#pragma once

#include "tools/cost_file.h"
#include "tools/scene_setup.h"
#include "tools/view_request.h"

#include <array>
#include <memory>
#include <string>
#include <vector>

namespace shadowdag {

class Truth;

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
};

/// The scene that is open and what renders it.
class ViewRenderer {
public:
    explicit ViewRenderer(ViewSettings settings);
    ~ViewRenderer();

    /// Opens SCENE with voxels of a resolution or, where `assetPath` is not empty, of a file. The
    /// scene before stays open when this throws, as loadSceneAndWorld and obtainDags do.
    /// @param console hears what takes time; it may throw to give up
    ViewSceneInfo open(const std::string& scene, uint32_t resolutionLog2,
                       const std::string& assetPath, const Console& console);
    /// Gives the open scene other voxels. As open().
    ViewSceneInfo setVoxels(uint32_t resolutionLog2, const std::string& assetPath,
                            const Console& console);
    /// Renders on another backend from now on; with a scene open, its renderers are made anew.
    /// Stays with the one before where that throws.
    void setBackend(Backend backend);
    bool isOpen() const { return open_ != nullptr; }

    /// Renders a request at a scale of its size. Every side but the truth's is whole; the truth's
    /// is whole where the request moves, else what isFinal = false says is refined by refine(). At
    /// a scale below 1 resolutions of maps are asked for as if at scale 1, so that shadows and
    /// routes stay what they are. Throws what FrameRenderer::render throws.
    std::shared_ptr<ViewPicture> render(const ViewRequest& request, float scale);
    /// Asks the truth for more samples of the last picture, for about `budgetMs`. Returns whether
    /// there is more to ask.
    bool refine(double budgetMs);
    /// Returns whether refine() has something to do.
    bool canRefine() const;
    /// Returns the last picture anew, with what refine() found since.
    std::shared_ptr<ViewPicture> picture();

    /// Renders a request at its full size, by itself (nothing kept from frames before, the truth
    /// asked in full), and writes `directory`/view-NNNN.png, .exr and .experiment.json, NNNN the
    /// first number that is free: what compare --experiment then renders again, bit by bit. Throws
    /// Error kUsage for a frozen view, kResource when a file cannot be written; files are whole or
    /// not there.
    SavedView save(const ViewRequest& request, const std::string& directory);

    const ViewSettings& settings() const { return settings_; }

private:
    struct Open;
    struct Shown;
    void moveTo(uint32_t frame);
    Camera cameraOf(const std::string& text) const;
    void renderSide(size_t side);
    void countErrors(const std::vector<uint32_t>& samples);
    std::vector<glm::vec3> truthColor() const;
    std::vector<glm::vec3> displayOf(size_t side, ViewPicture& picture);

    ViewSettings settings_;
    std::unique_ptr<Open> open_;
    std::unique_ptr<Shown> shown_;
};

} // namespace shadowdag

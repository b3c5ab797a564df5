// SPDX-License-Identifier: Apache-2.0
// `shadowdag scene`: writes a built-in scene as .glb, or lists the built-in scenes.
#include "scenes/builtin.h"
#include "scenes/gltf.h"
#include "tools/commands/commands.h"
#include "tools/settings/common_options.h"
#include "tools/workspace/scene_setup.h"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <iomanip>
#include <iostream>
#include <memory>

namespace shadowdag {

namespace {

struct SceneOptions {
    GlobalOptions global;
    std::string name, output;
    bool list = false;
};

void listScenes(const Console& console) {
    Json scenes = Json::array();
    for (const BuiltinInfo& info : builtinScenes()) {
        console.people() << std::left << std::setw(28) << info.name << info.description << "\n";
        scenes.push_back({{"name", info.name}, {"description", info.description}});
    }
    console.emit({{"scenes", std::move(scenes)}});
}

void runScene(const SceneOptions& options) {
    const Console console(options.global.json);
    options.global.apply(console, false, false);
    if (options.list) {
        if (!options.name.empty() || !options.output.empty())
            throw Error(ErrorKind::kUsage,
                        "--list takes neither NAME nor --output; drop them or --list");
        return listScenes(console);
    }
    if (options.name.empty() || options.output.empty())
        throw Error(ErrorKind::kUsage,
                    "scene needs NAME and -o F.glb, or --list; see shadowdag scene --help");
    checkExtension(options.output, {".glb"}, "scenes are written as .glb; use that extension");
    checkWritable(options.output);

    const std::string name =
        options.name.starts_with("builtin:") ? options.name.substr(8) : options.name;
    const Scene scene = makeBuiltin(name);
    writeGlb(scene, options.output);
    const World world(scene, {});
    const uint64_t bytes = std::filesystem::file_size(options.output);
    console.people() << options.output << ": " << world.triangles().count() << " triangles, "
                     << world.lights().size() << " lights, " << bytes << " bytes\n";
    console.emit({{"name", name},
                  {"output", options.output},
                  {"file_bytes", bytes},
                  {"triangle_count", world.triangles().count()},
                  {"light_count", world.lights().size()}});
}

} // namespace

std::function<void()> declareScene(CommandLine& commandLine) {
    auto options = std::make_shared<SceneOptions>();
    commandLine.text("NAME", options->name, "", "A built-in scene; --list lists them");
    commandLine.text("-o,--output", options->output, "F.glb", "The file to write");
    commandLine.flag("--list", options->list, "List the built-in scenes, one line each");
    options->global.declare(commandLine);
    return [options] { runScene(*options); };
}

} // namespace shadowdag

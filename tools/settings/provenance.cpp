// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/provenance.h"

#include "hybrid/judge/truth.h"
#include "shadowmap/gl_pages.h"
#include "tools/provenance_values.h"
#include "voxel/dag_stream.h"

#include <nlohmann/json.hpp>

#include <sys/utsname.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <fstream>

namespace shadowdag {

namespace {

/// Returns the processor's name as the kernel reports it, or the machine type.
std::string processorName() {
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line);)
        if (line.starts_with("model name"))
            if (const size_t colon = line.find(": "); colon != std::string::npos)
                return line.substr(colon + 2);
    utsname names{};
    return uname(&names) == 0 ? names.machine : "unknown";
}

/// Returns the name and release of the system, as os-release(5) has it, or the kernel's name.
std::string systemName() {
    std::ifstream file("/etc/os-release");
    for (std::string line; std::getline(file, line);)
        if (line.starts_with("PRETTY_NAME=\"") && line.ends_with('"'))
            return line.substr(13, line.size() - 14);
    utsname names{};
    return uname(&names) == 0 ? names.sysname : "unknown";
}

} // namespace

std::string programVersion() {
    return SDAG_VERSION;
}

std::string programCommit() {
    return SDAG_COMMIT;
}

std::string voxelSourceHash() {
    return SDAG_VOXEL_SOURCE_HASH;
}

std::string partVersion() {
    return programVersion() + "-" + voxelSourceHash();
}

Json buildProvenance(Backend backend) {
    const auto orNull = [](const std::string& text) { return text.empty() ? Json() : Json(text); };
    Json provenance{{"commit", programCommit()},
                    {"version", programVersion()},
                    {"preset", SDAG_PRESET},
                    {"build_type", SDAG_BUILD_TYPE},
                    {"compiler", SDAG_COMPILER},
                    {"flags", SDAG_FLAGS},
                    {"embree", embreeVersion()},
                    {"backend", backendName(backend)},
                    {"system", systemName()},
                    {"cpu", processorName()},
                    {kVectorInstructions, streamIsaName(bestStreamIsa())},
                    {"processor_count", sysconf(_SC_NPROCESSORS_ONLN)},
                    {"memory_bytes", sysconf(_SC_PHYS_PAGES) * sysconf(_SC_PAGESIZE)},
                    {"device", orNull(deviceName(backend))},
                    {"driver", orNull(driverVersion(backend))},
                    {"thread_count", threadCount()}};
    if (backend == Backend::kGl)
        provenance["gl_pages"] =
            chooseGlPages(requestedGlPages(), glDeviceInfo()) == GlPages::kSparse ? "sparse"
                                                                                  : "atlas";
    return provenance;
}

std::string textHash(const std::string& text) {
    uint64_t hash = 0xcbf29ce484222325ull;
    for (const char c : text)
        hash = (hash ^ uint8_t(c)) * 0x100000001b3ull;
    char digits[17];
    std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(hash));
    return digits;
}

} // namespace shadowdag

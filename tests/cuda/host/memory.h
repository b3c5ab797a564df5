// SPDX-License-Identifier: Apache-2.0
// The device's memory: one mapping that nobody can touch, except while queued work runs (Opened).
// An allocation ends at a page that is never accessible, its address is never used again, fresh
// memory is poisoned, and the bytes around it are checked. An access that is not allowed ends the
// process with the name of the allocation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace shadowdag::cuda_host {

/// The words of fresh memory: as floats they are NaN, as integers far beyond any list.
constexpr uint32_t kPoison = 0x7fbadbad;

/// The bytes of memory that the device has.
constexpr size_t kDeviceBytes = size_t(4) << 30;

/// Returns poisoned memory, aligned to 256 bytes. bytes > 0.
void* takeMemory(size_t bytes);
/// Gives a name to an allocation, for messages.
void nameMemory(const void* data, const char* name);
/// Makes an allocation inaccessible for ever, and checks the bytes around it.
void giveBackMemory(void* data);

/// Returns the bytes of an allocation that starts at `data` and was not given back, 0 for others.
size_t bytesOfMemory(const void* data);
/// Returns whether an address is one of the device.
bool isDeviceAddress(const void* address);
/// Returns "byte 4 of 'NAME', allocation 3 of 400 bytes", or what else an address is.
std::string describeAddress(const void* address);
/// Aborts, naming `what`, if not all of the bytes are in one allocation.
void checkRange(const void* data, size_t bytes, const std::string& what);
/// Aborts, naming `when`, if a byte around an allocation was written since memory was opened.
void checkAround(const std::string& when);

/// Lets this process access all allocations while it exists. One at a time.
class Opened {
public:
    Opened();
    ~Opened();
    Opened(const Opened&) = delete;
    Opened& operator=(const Opened&) = delete;
};

/// Gives this thread a stack for the handler of accesses that are not allowed.
void useSignalStack();

} // namespace shadowdag::cuda_host

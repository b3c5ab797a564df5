// SPDX-License-Identifier: Apache-2.0
// The device functions that the host files of cuda/ call. device_cuda.cu implements them where CUDA
// is compiled in, device_absent.cpp elsewhere: there every call but the first throws. Internal to
// this folder.
#pragma once

#include <cstddef>
#include <string>

namespace shadowdag::device {

/// Returns whether a device is found; if not, `why` receives the reason with the driver's own
/// message.
bool isPresent(std::string& why);

/// Returns the device's name and the CUDA version that its driver supports, as in "13.0". Throws
/// Error kDevice.
std::string name();
std::string driverVersion();

/// Returns `bytes` > 0 of device memory, or null when there is not enough. Throws Error kDevice for
/// any other failure.
/// @param name of the buffer, for messages of a device that the host plays (tests/cuda/host)
void* allocate(size_t bytes, const std::string& name);

/// Returns how many bytes allocate can still provide, according to the driver.
size_t availableBytes();

/// Releases memory from allocate, after the work queued before. Never throws.
void release(void* data) noexcept;

/// Queues a copy from host to device memory; the host memory may be reused at once. A copy of more
/// than 2 MiB waits for the work queued before.
void upload(void* dst, const void* src, size_t bytes);

/// Queues a copy within device memory.
void copyWithin(void* dst, const void* src, size_t bytes);

/// Copies from device to host memory, after the work queued before; returns when the copy is
/// complete.
void download(void* dst, const void* src, size_t bytes);

/// Returns `bytes` > 0 of host memory that downloadLater may write, or null if there is not enough;
/// releasePinned frees it and never throws.
void* allocatePinned(size_t bytes);
void releasePinned(void* data) noexcept;

/// Queues a copy from device to pinned host memory; it is complete when a mark recorded after it
/// has passed.
void downloadLater(void* dst, const void* src, size_t bytes);

/// A mark in the queue, which knows when the device passed it. recordMark puts one behind the work
/// queued before; waitForMark returns when it has passed; msBetween waits for `end` and returns the
/// milliseconds from `begin` to it; releaseMark never throws.
void* recordMark();
void waitForMark(void* mark);
double msBetween(void* begin, void* end);
void releaseMark(void* mark) noexcept;

/// Queues setting every byte to `byteValue`.
void fill(void* dst, int byteValue, size_t bytes);

/// Returns when all queued work is done. Throws Error kDevice if any of it failed.
void synchronize();

} // namespace shadowdag::device

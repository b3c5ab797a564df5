// SPDX-License-Identifier: Apache-2.0
// libjpeg reports errors by a function that must not return: the only setjmp of the project is in
// decodeJpeg, whose frame owns nothing that a jump would leak.
#include "scenes/color_image.h"

#include "cuda/error.h"
#include "scenes/alpha_mask.h"
#include "scenes/png_alpha.h"

#include <jerror.h>
#include <jpeglib.h> // needs FILE, which <string> above declares

#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <string_view>

namespace shadowdag {

namespace {

// A block of 8 x 8 pixels costs at least one bit, and a bit of the coarsest subsampling covers 4 x
// 4 of them.
constexpr uint64_t kMostPixelsPerByte = 8 * 16 * 64;
// Honest progressive files have about ten scans; each costs a pass over all pixels.
constexpr int kMaxScans = 100;

[[noreturn]] void failJpeg(const std::string& place, const std::string& problem) {
    throw Error(ErrorKind::kInput, place + ": " + problem + "; export the image again");
}

/// Names a format by how its files begin.
std::string formatOf(const uint8_t* data, size_t byteCount) {
    const std::string_view bytes(reinterpret_cast<const char*>(data), byteCount);
    if (bytes.starts_with("\xabKTX 20"))
        return "a KTX2 image";
    if (bytes.starts_with("RIFF") && bytes.substr(0, 12).ends_with("WEBP"))
        return "a WebP image";
    if (bytes.starts_with("DDS "))
        return "a DDS image";
    return "neither PNG nor JPEG";
}

/// What libjpeg's callbacks share. Plain data, because a jump skips destructors.
struct JpegState {
    jpeg_error_mgr errors;
    jpeg_progress_mgr progress;
    jmp_buf onError;
    char message[JMSG_LENGTH_MAX];
};

void endDecoding(j_common_ptr info) {
    auto* state = static_cast<JpegState*>(info->client_data);
    info->err->format_message(info, state->message);
    longjmp(state->onError, 1);
}

/// Damage is only a warning to libjpeg, which would fill the rest with grey.
void onMessage(j_common_ptr info, int level) {
    if (level == -1 && info->err->msg_code != JWRN_EXTRANEOUS_DATA)
        endDecoding(info);
}

void onProgress(j_common_ptr info) {
    if (reinterpret_cast<j_decompress_ptr>(info)->input_scan_number <= kMaxScans)
        return;
    auto* state = static_cast<JpegState*>(info->client_data);
    std::snprintf(state->message, sizeof state->message, "it has more than %d scans", kMaxScans);
    longjmp(state->onError, 1);
}

/// Decodes into `image`, whose memory is allocated by `allocate` once the size is known. Returns
/// false with a message in `state`.
/// @param allocate returns null, with a message in `state`, to refuse the size
template <class Allocate>
bool decodeJpeg(const uint8_t* data, size_t byteCount, JpegState& state, const Allocate& allocate) {
    jpeg_decompress_struct info;
    std::memset(&info, 0, sizeof info);
    info.err = jpeg_std_error(&state.errors);
    state.errors.error_exit = endDecoding;
    state.errors.emit_message = onMessage;
    info.client_data = &state;
    if (setjmp(state.onError)) {
        jpeg_destroy_decompress(&info);
        return false;
    }
    jpeg_create_decompress(&info);
    info.progress = &state.progress;
    state.progress.progress_monitor = onProgress;
    jpeg_mem_src(&info, data, static_cast<unsigned long>(byteCount));
    jpeg_read_header(&info, TRUE);
    info.out_color_space = JCS_RGB;
    uint8_t* const rgb = allocate(info.image_width, info.image_height);
    if (rgb == nullptr) {
        jpeg_destroy_decompress(&info);
        return false;
    }
    jpeg_start_decompress(&info);
    while (info.output_scanline < info.output_height) {
        JSAMPROW row = rgb + size_t(3) * info.output_scanline * info.output_width;
        jpeg_read_scanlines(&info, &row, 1);
    }
    jpeg_finish_decompress(&info);
    jpeg_destroy_decompress(&info);
    return true;
}

ColorImage readJpegColor(const uint8_t* data, size_t byteCount, const std::string& place) {
    ColorImage image;
    JpegState state{};
    bool isOutOfMemory = false;
    const auto allocate = [&](uint32_t width, uint32_t height) -> uint8_t* {
        const auto refuse = [&](const char* why) {
            std::snprintf(state.message, sizeof state.message, "%u x %u texels, %s", width, height,
                          why);
            return nullptr;
        };
        if (width < 1 || height < 1 || width > kMaxMaskSide || height > kMaxMaskSide ||
            uint64_t(width) * height > kMaxMaskTexels)
            return refuse("more than an image may have");
        if (uint64_t(width) * height > kMostPixelsPerByte * byteCount)
            return refuse("which its data cannot hold");
        image.width = width;
        image.height = height;
        try {
            image.rgb.resize(size_t(3) * width * height);
        } catch (const std::bad_alloc&) { // must not pass through libjpeg's frame
            isOutOfMemory = true;
            return nullptr;
        }
        return image.rgb.data();
    };
    if (decodeJpeg(data, byteCount, state, allocate))
        return image;
    if (isOutOfMemory)
        throw Error(ErrorKind::kResource, place + ": not enough memory to decode the image");
    failJpeg(place, std::string("the JPEG is damaged or not supported: ") + state.message);
}

} // namespace

bool isJpeg(const uint8_t* data, size_t byteCount) {
    return byteCount >= 3 && data[0] == 0xff && data[1] == 0xd8 && data[2] == 0xff;
}

ColorImage readColorImage(const uint8_t* data, size_t byteCount, const std::string& place) {
    if (isPng(data, byteCount))
        return readPngColor(data, byteCount, place);
    if (isJpeg(data, byteCount))
        return readJpegColor(data, byteCount, place);
    throw Error(ErrorKind::kInput,
                place + ": " + formatOf(data, byteCount) + ", but only PNG and JPEG are read");
}

} // namespace shadowdag

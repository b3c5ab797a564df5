// SPDX-License-Identifier: Apache-2.0
// Data within URIs. Source: RFC 2397 ("data" URL scheme); RFC 4648, sec. 4 (base64). Only base64 is
// read, as glTF 2.0, sec. 3.6.1.1 and 3.8.3, ask for.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace shadowdag {

/// What a data URI holds.
struct DataUri {
    std::vector<uint8_t> bytes;
    std::string problem; ///< why it cannot be read, "its data URI ..."; empty if it can
};

/// Returns whether a URI has the scheme "data", in any case.
bool isDataUri(std::string_view uri);

/// Returns the data of a URI of that scheme, of any media type. Spaces and line ends within the
/// base64 are ignored, and padding may be missing.
DataUri decodeDataUri(std::string_view uri);

/// Returns a URI with its %XX decoded. Source: RFC 3986, sec. 2.1.
std::string decodeUri(std::string_view uri);

} // namespace shadowdag

// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/mutation.h"

#include <algorithm>
#include <cctype>
#include <cstring>

namespace shadowdag::fuzz {

namespace {

constexpr uint64_t kNumbers[] = {0,
                                 1,
                                 2,
                                 3,
                                 4,
                                 7,
                                 8,
                                 127,
                                 128,
                                 255,
                                 256,
                                 4095,
                                 32767,
                                 65535,
                                 65536,
                                 1000000,
                                 0x7fffffff,
                                 0x80000000,
                                 ~0u,
                                 1u << 30,
                                 1ull << 32,
                                 1ull << 40,
                                 1ull << 62,
                                 1ull << 63,
                                 ~0ull,
                                 0x7fc00000,
                                 0x7f800000,
                                 0x7ff8000000000000,
                                 0x7ff0000000000000};
constexpr const char* kTexts[] = {"-1",
                                  "0",
                                  "1",
                                  "0.5",
                                  "-0.0",
                                  "1e300",
                                  "-1e-300",
                                  "1e39",
                                  "255",
                                  "65536",
                                  "2147483647",
                                  "4294967295",
                                  "null",
                                  "true",
                                  "[]",
                                  "{}",
                                  "\"\"",
                                  "inf",
                                  "nan",
                                  "18446744073709551615",
                                  "-9223372036854775808",
                                  "1e999",
                                  "[0]",
                                  "[[]]",
                                  "\"\\u0000\"",
                                  "100000000"};

bool isNumberPart(char c) {
    return std::isdigit(static_cast<unsigned char>(c)) || c == '.' || c == '-' || c == '+' ||
           c == 'e' || c == 'E';
}

/// A place in a content; of binary contents, which are mostly zeros, more likely one that is not.
size_t placeIn(const std::string& content, test::Random& random) {
    size_t at = random.below(content.size());
    for (int i = 0; i < 8 && content[at] == '\0'; ++i)
        at = random.below(content.size());
    return at;
}

void changeBytes(std::string& content, test::Random& random) {
    const size_t at = placeIn(content, random);
    switch (random.below(4)) {
    case 0:
        content[at] = char(content[at] ^ (1 << random.below(8)));
        break;
    case 1:
        content[at] = char(random.below(256));
        break;
    default: {
        const size_t bytes = size_t(1) << (1 + random.below(3));
        uint64_t value = kNumbers[random.below(std::size(kNumbers))];
        if (random.below(4) == 0) {
            std::memcpy(&value, content.data() + at, std::min(bytes, content.size() - at));
            value += random.below(9) - 4u;
        }
        std::memcpy(content.data() + at, &value, std::min(bytes, content.size() - at));
    }
    }
}

/// Replaces a number of a text.
void changeNumber(std::string& content, const std::vector<std::string>& words,
                  test::Random& random) {
    size_t begin = placeIn(content, random);
    while (begin < content.size() && !std::isdigit(static_cast<unsigned char>(content[begin])))
        ++begin;
    size_t end = begin;
    while (begin > 0 && isNumberPart(content[begin - 1]))
        --begin;
    while (end < content.size() && isNumberPart(content[end]))
        ++end;
    const bool isWord = !words.empty() && random.below(4) == 0;
    content.replace(begin, end - begin,
                    isWord ? words[random.below(words.size())]
                           : std::string(kTexts[random.below(std::size(kTexts))]));
}

void moveRange(std::string& content, test::Random& random) {
    const size_t at = placeIn(content, random);
    const size_t count =
        1 + random.below(std::min<size_t>(content.size() - at, size_t(4) << (2 * random.below(5))));
    switch (random.below(4)) {
    case 0:
        content.erase(at, count);
        break;
    case 1:
        content.insert(random.below(content.size()), content.substr(at, count));
        break;
    case 2: {
        const std::string range = content.substr(at, count);
        content.replace(placeIn(content, random), count, range);
        break;
    }
    default:
        if (random.below(4) == 0)
            content.resize(at);
        else
            std::reverse(content.begin() + long(at), content.begin() + long(at + count));
    }
}

} // namespace

std::vector<std::string> wordsOf(const std::string& input) {
    std::vector<std::string> words;
    for (size_t i = 0; i < input.size(); ++i) {
        size_t end = i;
        if (input[i] == '"')
            end = input.find('"', i + 1) == std::string::npos ? i : input.find('"', i + 1) + 1;
        else if (std::isdigit(static_cast<unsigned char>(input[i])))
            while (end < input.size() && isNumberPart(input[end]))
                ++end;
        if (end > i && end - i < 64)
            words.push_back(input.substr(i, end - i));
        i = std::max(i, end - (end > i));
    }
    std::sort(words.begin(), words.end());
    words.erase(std::unique(words.begin(), words.end()), words.end());
    return words;
}

std::string mutated(std::string content, size_t maxBytes, const std::vector<std::string>& words,
                    test::Random& random) {
    for (uint32_t changes = 1 + random.below(4); changes > 0; --changes) {
        if (content.empty())
            content = "0";
        switch (random.below(5)) {
        case 0:
        case 1:
            changeBytes(content, random);
            break;
        case 2:
            changeNumber(content, words, random);
            break;
        case 3:
            moveRange(content, random);
            break;
        default:
            if (words.empty())
                changeBytes(content, random);
            else
                content.insert(random.below(content.size() + 1), words[random.below(words.size())]);
        }
    }
    content.resize(std::min(content.size(), maxBytes));
    return content;
}

std::string mutatedInput(const FuzzTarget& target, const std::string& input,
                         const std::vector<std::string>& words, test::Random& random) {
    std::string content = target.unpack ? target.unpack(input) : input;
    const size_t most = target.unpack ? std::max(content.size(), target.maxBytes) : target.maxBytes;
    content = mutated(std::move(content), most, words, random);
    if (target.pack)
        content = target.pack(content);
    content.resize(std::min(content.size(), target.maxBytes));
    return content;
}

} // namespace shadowdag::fuzz

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

/// Text that comes from anywhere: files, options, names of folders.
namespace arex {

/// The code point at text[at], which moves behind it; nullopt if no well-formed UTF-8 stands there.
std::optional<char32_t> take_utf8(std::string_view text, std::size_t& at);

/// The same text on one line and without a byte that a terminal could obey: control characters,
/// what turns the direction of writing, and what is no UTF-8 become `\xNN`.
std::string printable(std::string_view text);

/// The first so many bytes, and "..." in the place of the rest.
std::string shortened(std::string_view text, std::size_t longest = 60);

/// Decimal numbers, read alike in files, overrides and options. The whole text counts, a leading
/// '+' is allowed, and leading zeros mean nothing: 010 is ten. No hexadecimal, no octal, no
/// underscores; what does not fit the type is no number of it.
std::optional<int> parse_int(std::string_view text);
std::optional<std::uint64_t> parse_uint64(std::string_view text);
std::optional<double> parse_double(std::string_view text);  ///< finite

}  // namespace arex

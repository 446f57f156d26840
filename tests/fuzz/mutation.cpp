#include "fuzz/mutation.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace arex::test {
namespace {

using std::string_view_literals::operator""sv;

constexpr auto kValues =
    std::to_array<std::string_view>({"0",
                                     "-0",
                                     "1",
                                     "-1",
                                     "010",
                                     "08",
                                     "0x10",
                                     "0o17",
                                     "1_000",
                                     "1e-10",
                                     "1e-300",
                                     "1e-400",
                                     "1e10",
                                     "1e300",
                                     "1e400",
                                     "-1e300",
                                     ".nan",
                                     ".inf",
                                     "-.inf",
                                     "nan",
                                     "inf",
                                     "0.001",
                                     "1e9",
                                     "1000000000",
                                     "2147483647",
                                     "2147483648",
                                     "-2147483648",
                                     "18446744073709551615",
                                     "18446744073709551616",
                                     "9007199254740993",
                                     "true",
                                     "false",
                                     "yes",
                                     "~",
                                     "null",
                                     "\"\"",
                                     "''",
                                     "\"\\x1b[31m\"",
                                     "\"a\\0b\"",
                                     "\"\\n\"",
                                     "[]",
                                     "{}",
                                     "[0]",
                                     "[1, 2, 3]",
                                     "[[1, 2, 3]]",
                                     "[1, [2, [3]]]",
                                     "{a: 1}",
                                     "[1e300, 1e300, 1e300]",
                                     "[-1, -1, -1]",
                                     "[0, 0, 0]",
                                     "1..3",
                                     "0..18446744073709551615",
                                     "18446744073709551610..18446744073709551615",
                                     "5..1",
                                     "../../etc/passwd",
                                     "/dev/zero",
                                     "forest",
                                     "empty",
                                     "|",
                                     ">",
                                     "&a",
                                     "*a",
                                     "!!binary x",
                                     "@",
                                     "`",
                                     "%",
                                     "- -",
                                     ": :"});

constexpr auto kLines = std::to_array<std::string_view>({"a: &a [*a]\n"sv,
                                                         "? [1, 2]\n: 3\n"sv,
                                                         "<<: {seed: 1}\n"sv,
                                                         "---\n"sv,
                                                         "...\n"sv,
                                                         "--- |\n"sv,
                                                         "%YAML 9.9\n"sv,
                                                         "%TAG ! tag:x,2000:\n"sv,
                                                         "\t- x\n"sv,
                                                         "\x1b]0;title\x07\n"sv,
                                                         "\xff\xfe\n"sv,
                                                         "\xc2\x9b\n"sv,
                                                         "\0\n"sv,
                                                         "\r"sv,
                                                         "\r\n"sv,
                                                         "\xef\xbb\xbf"sv,
                                                         "}\n"sv,
                                                         "]\n"sv,
                                                         "[[[[[[[[[[[[\n"sv,
                                                         "{a: {a: {a: {a: {a: {a: \n"sv,
                                                         "'\n"sv,
                                                         "\"\n"sv,
                                                         "!!python/object:x {}\n"sv,
                                                         "* \n"sv,
                                                         "& \n"sv,
                                                         "x: *x\n"sv,
                                                         "seed: 1\nseed: 1\n"sv,
                                                         "? \n"sv,
                                                         ": \n"sv,
                                                         "- \n"sv,
                                                         "key: >\n  folded\n"sv});

std::size_t below(std::size_t bound, RandomStream& random) {
  return static_cast<std::size_t>(random.bits() % std::max<std::size_t>(1, bound));
}

template <class List>
auto& any(List& list, RandomStream& random) {
  return list[below(list.size(), random)];
}

void damage_once(std::string& bytes, const std::vector<std::string>& others, RandomStream& random) {
  const std::size_t at = below(bytes.size() + 1, random);
  const std::size_t length = std::min(below(64, random) + 1, bytes.size() - at);
  switch (below(7, random)) {
    case 0:
      if (at < bytes.size()) bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(8, random)));
      break;
    case 1:
      bytes.erase(at, length);
      break;
    case 2:
      bytes.insert(at, bytes.substr(at, length));
      break;
    case 3:
      bytes.insert(below(bytes.size() + 1, random), bytes.substr(at, length));
      break;
    case 4:
      for (std::size_t i = at; i < at + length; ++i) bytes[i] = static_cast<char>(random.bits());
      break;
    case 5:
      bytes.resize(at);
      break;
    default: {
      if (others.empty()) break;
      const std::string& other = any(others, random);
      const std::size_t from = below(other.size() + 1, random);
      bytes.insert(at, other.substr(from, below(512, random)));
    }
  }
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size() - 1) + 1;
    lines.push_back(text.substr(begin, end - begin));
    begin = end;
  }
  return lines;
}

// What stands behind the first ': ' of a line becomes something else.
void replace_value(std::string& line, RandomStream& random) {
  const std::size_t colon = line.find(": ");
  if (colon == std::string::npos) return;
  line = line.substr(0, colon + 2) + hostile_value(random) + "\n";
}

void damage_line(std::vector<std::string>& lines, RandomStream& random) {
  if (lines.empty()) return;
  const std::size_t at = below(lines.size(), random);
  const auto place = lines.begin() + static_cast<std::ptrdiff_t>(at);
  switch (below(6, random)) {
    case 0:
      lines.insert(place, std::string(any(kLines, random)));
      break;
    case 1:
      lines.insert(place, std::string(lines[at]));
      break;
    case 2:
      lines.erase(place);
      break;
    case 3:
      lines[at].insert(0, below(9, random), ' ');
      break;
    case 4:
      std::swap(lines[at], any(lines, random));
      break;
    default:
      replace_value(lines[at], random);
  }
}

}  // namespace

std::string hostile_value(RandomStream& random) { return std::string(any(kValues, random)); }

std::string damage_bytes(std::string bytes, const std::vector<std::string>& others,
                         RandomStream& random) {
  const std::size_t wounds = 1 + below(4, random);
  for (std::size_t i = 0; i < wounds; ++i) damage_once(bytes, others, random);
  return bytes;
}

std::string damage_yaml(std::string text, const std::vector<std::string>& others,
                        RandomStream& random) {
  if (below(4, random) == 0) return damage_bytes(std::move(text), others, random);
  std::vector<std::string> lines = lines_of(text);
  const std::size_t wounds = 1 + below(3, random);
  for (std::size_t i = 0; i < wounds; ++i) damage_line(lines, random);
  std::string damaged;
  for (const std::string& line : lines) damaged += line;
  return damaged;
}

}  // namespace arex::test

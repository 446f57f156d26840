#include <gtest/gtest.h>
#include <sys/stat.h>

#include <ctime>

#include "config/config.h"
#include "support/temporary_folder.h"

// What people and fuzzers hand to a program that reads YAML: refused with one printable line at its
// place, and within a second of this process's time.
namespace arex {
namespace {

using test::TemporaryFolder;
using test::write_text;

template <class Read>
std::string refusal(const Read& read) {
  const std::clock_t begin = std::clock();
  std::string message = "no error";
  try {
    read();
  } catch (const ConfigError& error) {
    message = error.what();
  }
  EXPECT_LT(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC, 1) << message;
  for (const char c : message) EXPECT_GE(static_cast<unsigned char>(c), 0x20) << message;
  EXPECT_LT(message.size(), 400u);
  return message;
}

std::string refusal_of(const std::string& text) {
  return refusal([&] { parse_yaml(text, "a.yaml"); });
}

TEST(HostileYaml, AliasesThatHoldThemselvesAreRefused) {
  EXPECT_EQ(refusal_of("a: &a [*a]\n"),
            "a.yaml:1: an alias stands inside of what it names, expected it behind that");
  EXPECT_NE(refusal_of("x: 1\na: &a {b: {c: [1, *a]}}\n").find("a.yaml:2: an alias"),
            std::string::npos);
  EXPECT_NE(refusal_of("a: &a [&b [*a], *b]\n").find("a.yaml:1: an alias"), std::string::npos);
  EXPECT_NE(refusal_of("a: *nowhere\n").find("a.yaml:1: not valid YAML"), std::string::npos);
}

// `levels` names of nine times the name before.
std::string bomb(int levels, const std::string& kind) {
  std::string text = "a0: &a0 " + (kind == "list" ? std::string("[1, 2, 3]") : "{x: 1}") + "\n";
  for (int level = 1; level <= levels; ++level) {
    const std::string before = "*a" + std::to_string(level - 1);
    text += "a" + std::to_string(level) + ": &a" + std::to_string(level);
    text += kind == "list" ? " [" : " {";
    for (int i = 0; i < 9; ++i) {
      text += (i ? ", " : "") + (kind == "list" ? before : "k" + std::to_string(i) + ": " + before);
    }
    text += kind == "list" ? "]\n" : "}\n";
  }
  return text;
}

TEST(HostileYaml, AliasBombsAreRefusedAndHonestAliasesFollowed) {
  for (const char* kind : {"list", "map"}) {
    for (const int levels : {9, 30}) {
      EXPECT_NE(refusal_of(bomb(levels, kind)).find(" values, aliases followed; expected fewer"),
                std::string::npos)
          << kind << levels;
    }
  }
  const ConfigNode node = parse_yaml("a: &a {x: 1, y: &y [2, 3]}\nb: *a\nc: [*y, *y]\n", "a.yaml");
  EXPECT_EQ(node.find("b")->find("x")->scalar, "1");
  EXPECT_EQ(node.find("c")->items.at(1).items.at(0).scalar, "2");
}

TEST(HostileYaml, DeepNestingIsRefused) {
  for (const char* step : {"[", "{a: ", "- ", "? ", "!!x [", "&a ["}) {
    for (const int depth : {40, 5000, 100'000}) {
      std::string text = "a: ";
      for (int i = 0; i < depth; ++i) text += step;
      EXPECT_EQ(refusal_of(text).find("a.yaml:1"), 0u) << step << depth;
    }
  }
  std::string block;
  for (int i = 0; i < 200; ++i) block += std::string(static_cast<std::size_t>(i), ' ') + "a:\n";
  EXPECT_NE(refusal_of(block).find("nested deeper than 32 levels"), std::string::npos);
}

TEST(HostileYaml, LargeTextsAreRefused) {
  EXPECT_NE(refusal_of("# " + std::string(std::size_t{2} << 20U, 'x')).find("longer than"),
            std::string::npos);
  std::string many = "a: [";
  for (int i = 0; i < 300'000; ++i) many += "1,";
  EXPECT_NE(refusal_of(many + "]").find("values"), std::string::npos);
  std::string keys;
  for (int i = 0; i < 40'000; ++i) keys += "k" + std::to_string(i) + ": 1\n";
  EXPECT_EQ(refusal_of(keys), "no error");  // and quickly
  EXPECT_EQ(refusal_of(std::string(100'000, 'k') + ": 1\n").find("a.yaml:1: "), 0u);
}

TEST(HostileYaml, OneDocumentOfPlainValues) {
  EXPECT_EQ(refusal_of("a: 1\n---\nb: 2\n"), "a.yaml:2: a second document begins, expected one");
  EXPECT_EQ(refusal_of("---\na: 1\n...\n"), "no error");
  EXPECT_EQ(refusal_of("a: &a {x: 1}\nb:\n  <<: *a\n"),
            "a.yaml:3: a merge key '<<', expected the keys themselves");
  EXPECT_NE(refusal_of("a: !!binary aGk=\n").find("a.yaml:1: has the tag"), std::string::npos);
  EXPECT_NE(refusal_of("a: !mine {x: 1}\n").find("a.yaml:1: has the tag"), std::string::npos);
  EXPECT_NE(refusal_of("b: 1\na: !!python/object [x]\n").find("a.yaml:2: has the tag"),
            std::string::npos);
  EXPECT_EQ(refusal_of("a: '1'\nb: \"2\"\n"), "no error");
  EXPECT_NE(refusal_of("[a]: 1\n").find("a key must be a plain word"), std::string::npos);
  EXPECT_NE(refusal_of("{a: 1}: 1\n").find("a key must be a plain word"), std::string::npos);
  EXPECT_NE(refusal_of(": 1\n").find("a key is missing"), std::string::npos);
  EXPECT_NE(refusal_of("a: &k x\n*k : 1\n").find("an alias stands for a key"), std::string::npos);
  EXPECT_NE(refusal_of("a: 1\n\"a\": 2\n").find("a.yaml:2: duplicate key 'a'"), std::string::npos);
}

TEST(HostileYaml, OnlyTextOfUtf8IsRead) {
  EXPECT_EQ(refusal_of(std::string("a: 1\nb: \0\n", 10)),
            "a.yaml:2: control character \\x00, expected a text of UTF-8");
  EXPECT_EQ(refusal_of("a: \x1b[2J\n"),
            "a.yaml:1: control character \\x1b, expected a text of UTF-8");
  EXPECT_EQ(refusal_of("a: \xc2\x9b[31m\n"),
            "a.yaml:1: control character \\xc2\\x9b, expected a text of UTF-8");
  EXPECT_EQ(refusal_of("# \n#\n# \xff\n"),
            "a.yaml:3: no UTF-8: byte \\xff, expected a text of UTF-8");
  EXPECT_EQ(refusal_of("\xff\xfe"
                       "a\0:\0")
                .find("a.yaml:1: no UTF-8"),
            0u);                                                              // UTF-16
  EXPECT_EQ(refusal_of("a: \xc0\xaf\n").find("a.yaml:1: no UTF-8"), 0u);      // overlong
  EXPECT_EQ(refusal_of("a: \xed\xa0\x80\n").find("a.yaml:1: no UTF-8"), 0u);  // a surrogate
  EXPECT_EQ(refusal_of("a: 1\rb: 2\n").find("a.yaml:1: control character \\x0d"), 0u);
  EXPECT_EQ(refusal_of("a: 'W\xc3\xa4lder'\n"), "no error");
}

TEST(HostileYaml, ByteOrderMarksAndWindowsLineEndsAreNoMatter) {
  const ConfigNode node = parse_yaml(
      "\xef\xbb\xbf"
      "a: 1\r\nb:\r\n  c: 2\r\n",
      "a.yaml");
  EXPECT_EQ(node.find("a")->scalar, "1");
  EXPECT_EQ(node.find("b")->find("c")->scalar, "2");
  EXPECT_EQ(refusal_of("a: 1\r\nb: 2\r\na: 3\r\n"),
            "a.yaml:3: duplicate key 'a', expected each key once");
}

TEST(HostileYaml, OnlyFilesWithKeysAreRead) {
  const TemporaryFolder folder;
  const auto load = [&](const std::string& name) {
    const std::string message = refusal([&] { load_yaml(folder / name); });
    const std::string prefix = (folder / name).string() + ":1: ";
    return message.starts_with(prefix) ? message.substr(prefix.size()) : message;
  };
  EXPECT_EQ(load("."), "is a directory, expected a YAML file");
  ASSERT_EQ(mkfifo((folder / "fifo").c_str(), 0600), 0);
  EXPECT_EQ(load("fifo"), "is a pipe, a socket or a device, expected a YAML file");
  EXPECT_EQ(load("none"), "cannot be read, expected a YAML file");
  write_text(folder / "empty", "");
  EXPECT_EQ(load("empty"), "the file is empty, expected keys ('{}' for none)");
  write_text(folder / "blank", " \n\n");
  EXPECT_EQ(load("blank"), "the file is empty, expected keys ('{}' for none)");
  write_text(folder / "braces", "{}\n");
  EXPECT_EQ(load("braces"), "no error");
  write_text(folder / "huge", "");
  std::filesystem::resize_file(folder / "huge", std::uintmax_t{1} << 32U);  // a hole, 4 GiB
  EXPECT_EQ(load("huge").find("longer than "), 0u);
  EXPECT_NE(refusal([] { load_yaml("/dev/zero"); }).find("is a pipe, a socket or a device"),
            std::string::npos);
  std::filesystem::create_symlink("loop", folder / "loop");
  EXPECT_EQ(load("loop"), "cannot be read, expected a YAML file");
}

TEST(HostileYaml, MessagesAreOnePrintableLine) {
  EXPECT_EQ(std::string(ConfigError("a\nb\x1b[31m\xff \xc3\xa9 \xe2\x80\xae").what()),
            "a\\x0ab\\x1b[31m\\xff \xc3\xa9 \\xe2\\x80\\xae");
  const std::string nul("a\0b", 3);
  EXPECT_EQ(std::string(ConfigError(nul).what()), "a\\x00b");
}

}  // namespace
}  // namespace arex

#include "semantics/cloud_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <limits>

#include "autonomy/semantics/cloud_bytes.h"
#include "config/config.h"
#include "config/text.h"
#include "fuzz/mutation.h"
#include "support/temporary_folder.h"

namespace arex::test {
namespace {

void write(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

CloudFile read(const std::string& bytes) {
  const TemporaryFolder folder;
  write(folder / "cloud", bytes);
  return read_cloud_file(folder / "cloud");
}

/// The one line that a broken file is refused with.
std::string refusal(const std::string& bytes) {
  try {
    read(bytes);
  } catch (const ConfigError& error) {
    EXPECT_EQ(printable(error.what()), error.what());
    return error.what();
  }
  return "";
}

TEST(CloudFile, ReadsEveryEncoding) {
  const std::vector<Vec3f> points = some_points(300);
  int kind = 0;
  for (const std::string& bytes : all_encodings(points)) {
    const CloudFile cloud = read(bytes);
    ASSERT_EQ(cloud.points.size(), points.size()) << "encoding " << kind;
    ASSERT_EQ(cloud.intensity.size(), points.size()) << "encoding " << kind;
    for (std::size_t i = 0; i < points.size(); ++i) {
      ASSERT_EQ(cloud.points[i], points[i]) << "encoding " << kind << ", point " << i;
      ASSERT_EQ(cloud.intensity[i], static_cast<float>(i % 256));
    }
    EXPECT_TRUE(cloud.origin.isZero());
    ++kind;
  }
}

TEST(CloudFile, ReadsRunsThatReferBackInCompressedPoints) {
  // All points are alike: with LZF, a run of four bytes and references to it.
  constexpr std::size_t kCount = 200;
  std::string raw;
  for (int k = 0; k < 4; ++k) {
    for (std::size_t i = 0; i < kCount; ++i) append(raw, 1.5F);
  }
  std::string packed = "\x03" + raw.substr(0, 4);
  for (std::size_t left = raw.size() - 4; left > 0;) {
    const std::size_t length = std::min<std::size_t>(left, 264);
    if (length >= 9) {
      packed += static_cast<char>(7 << 5);
      packed += static_cast<char>(length - 9);
    } else {
      packed += static_cast<char>((length - 2) << 5);
    }
    packed += '\x03';  // four bytes back
    left -= length;
  }
  std::string bytes = pcd_header(kXyzi, kCount, "binary_compressed");
  append(bytes, static_cast<std::uint32_t>(packed.size()));
  append(bytes, static_cast<std::uint32_t>(raw.size()));
  const CloudFile cloud = read(bytes + packed);
  ASSERT_EQ(cloud.points.size(), kCount);
  for (const Vec3f& p : cloud.points) EXPECT_EQ(p, Vec3f::Constant(1.5F));
}

TEST(CloudFile, ReadsOtherFieldsTypesAndLines) {
  // Fields in any order, padding, a histogram, integers, no COUNT of one, carriage returns.
  std::string bytes =
      "VERSION .7\r\nFIELDS ring z _ y h x\r\nSIZE 2 8 1 4 4 2\r\nTYPE U F U F F I\r\n"
      "COUNT 1 1 3 1 2 1\r\nWIDTH 50\r\nHEIGHT 3\r\nPOINTS 150\r\nDATA binary\r\n";
  for (int i = 0; i < 150; ++i) {
    append(bytes, static_cast<std::uint16_t>(i));
    append(bytes, 0.25 * i);
    bytes += "abc";
    append(bytes, -0.5F * static_cast<float>(i));
    append(bytes, 1.0F);
    append(bytes, 2.0F);
    append(bytes, static_cast<std::int16_t>(-i));
  }
  const CloudFile cloud = read(bytes);
  ASSERT_EQ(cloud.points.size(), 150u);
  EXPECT_TRUE(cloud.intensity.empty());
  EXPECT_EQ(cloud.points[149], Vec3f(-149, -74.5F, 37.25F));

  std::string text =
      "# .PCD v.7\nVERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 120\nHEIGHT 1\n"
      "POINTS 120\nDATA ascii\n";
  for (int i = 0; i < 119; ++i) text += "  +1e0\t" + std::to_string(i) + " -2.5\r\n\n";
  text += "nan inf -nan";  // the last line may have no end
  const CloudFile other = read(text);
  ASSERT_EQ(other.points.size(), 120u);
  EXPECT_EQ(other.points[7], Vec3f(1, 7, -2.5F));
  EXPECT_FALSE(other.points[119].allFinite());
}

TEST(CloudFile, KeepsAMapProjectionsCoordinates) {
  const Vec3 far(564321.25, 5934567.5, 321.125);
  std::string bytes =
      pcd_header("FIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\n", 200, "binary");
  const std::vector<Vec3f> points = some_points(200);
  for (const Vec3f& p : points) {
    for (int k = 0; k < 3; ++k) append(bytes, far[k] + static_cast<double>(p[k]));
  }
  const CloudFile cloud = read(bytes);
  EXPECT_EQ(cloud.origin.z(), 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3 p = cloud.origin + cloud.points[i].cast<double>();
    EXPECT_LT((p - far - points[i].cast<double>()).norm(), 1e-4);
  }
  // And gives them back.
  const TemporaryFolder folder;
  SemanticMap map;
  map.labels.assign(points.size(), SemanticClass::kTrunk);
  write(folder / "semantic.pcd", semantic_pcd(cloud, map));
  const CloudFile again = read_cloud_file(folder / "semantic.pcd");
  EXPECT_EQ(again.origin, cloud.origin);
  EXPECT_EQ(again.points, cloud.points);
}

TEST(CloudFile, RefusesWhatIsNoCloudWithOneLine) {
  const std::vector<Vec3f> points = some_points(200);
  EXPECT_NE(refusal("").find("neither PCD nor PLY"), std::string::npos);
  EXPECT_NE(refusal("world: {}\n").find("neither PCD nor PLY"), std::string::npos);
  EXPECT_NE(refusal("# a comment\n").find("no DATA line"), std::string::npos);
  EXPECT_NE(refusal("ply\n").find("end_header"), std::string::npos);
  EXPECT_NE(refusal(pcd_binary(some_points(99))).find("at least 100"), std::string::npos);
  for (const std::string& bytes : all_encodings(points)) {
    EXPECT_FALSE(refusal(bytes.substr(0, bytes.size() / 2)).empty());
  }
  const auto changed = [&](std::string bytes, const std::string& from, const std::string& to) {
    return refusal(bytes.replace(bytes.find(from), from.size(), to));
  };
  const std::string binary = pcd_binary(points);
  EXPECT_NE(changed(binary, "FIELDS x", "FIELDS q").find("x, y, z"), std::string::npos);
  EXPECT_NE(changed(binary, "SIZE 4", "SIZE 3").find("SIZE 3"), std::string::npos);
  EXPECT_NE(changed(binary, "TYPE F F", "TYPE F").find("differ in length"), std::string::npos);
  EXPECT_NE(changed(binary, "POINTS 200", "POINTS 201").find("WIDTH times HEIGHT"),
            std::string::npos);
  EXPECT_NE(changed(binary, "DATA binary", "DATA zipped").find("zipped"), std::string::npos);
  EXPECT_NE(changed(pcd_ascii(points), "DATA ascii\n", "DATA ascii\n1 two 3 4\n").find("line 12"),
            std::string::npos);
}

// What a header's number would have to be read as is anybody's guess, and points that it does not
// announce would be lost without a word.
TEST(CloudFile, RefusesHeadersThatLie) {
  const std::vector<Vec3f> points = some_points(200);
  const auto changed = [&](std::string bytes, const std::string& from, const std::string& to) {
    EXPECT_NE(bytes.find(from), std::string::npos) << from;
    return refusal(bytes.replace(bytes.find(from), from.size(), to));
  };
  const std::vector<std::string> wrong{"199.5", "200.0", "-200", "+200",
                                       "2e2",   "0xC8",  "nan",  "99999999999999999999"};
  const std::vector<std::string> files = all_encodings(points);
  for (std::size_t kind = 0; kind < files.size(); ++kind) {
    const std::string& bytes = files[kind];
    const bool pcd = kind < 3;
    for (const std::string& number : wrong) {
      if (pcd) {
        for (const std::string key : {"POINTS ", "WIDTH "}) {
          EXPECT_NE(changed(bytes, key + "200\n", key + number + "\n").find("whole number"),
                    std::string::npos)
              << kind << key << number;
        }
        EXPECT_NE(changed(bytes, "COUNT 1", "COUNT " + number).find("whole number"),
                  std::string::npos);
        EXPECT_NE(changed(bytes, "SIZE 4", "SIZE " + number).find("whole number"),
                  std::string::npos);
        EXPECT_NE(changed(bytes, "HEIGHT 1", "HEIGHT " + number).find("whole number"),
                  std::string::npos);
      } else {
        EXPECT_NE(changed(bytes, "vertex 200", "vertex " + number).find("whole number"),
                  std::string::npos)
            << kind << number;
      }
    }
    if (pcd) {
      EXPECT_NE(changed(bytes, "WIDTH 200", "WIDTH 200 7").find("WIDTH"), std::string::npos);
      EXPECT_NE(changed(bytes, "HEIGHT 1", "HEIGHT 1\nHEIGHT 1").find("two lines HEIGHT"),
                std::string::npos);
    } else {
      EXPECT_NE(changed(bytes, "vertex 200", "vertex 200 7").find("behind its number"),
                std::string::npos);
      EXPECT_NE(changed(bytes, "element face", "element vertex").find("two elements vertex"),
                std::string::npos);
    }
  }
}

TEST(CloudFile, RefusesMorePointsThanAnnounced) {
  const std::vector<Vec3f> points = some_points(200);
  for (std::string bytes : {pcd_ascii(points), pcd_binary(points)}) {
    const auto replace = [&](const std::string& from, const std::string& to) {
      bytes.replace(bytes.find(from), from.size(), to);
    };
    replace("WIDTH 200", "WIDTH 150");
    replace("POINTS 200", "POINTS 150");
    EXPECT_NE(refusal(bytes).find("goes on behind its 150 points"), std::string::npos);
  }
  EXPECT_NE(refusal(pcd_compressed(points) + "more").find("goes on"), std::string::npos);
  EXPECT_NE(refusal(pcd_binary(points) + "\1").find("goes on"), std::string::npos);
  // A column that FIELDS does not name.
  std::string wide = pcd_ascii(points);
  wide.insert(wide.find('\n', wide.find("DATA ascii\n") + 11), " 7");
  EXPECT_NE(refusal(wide).find("line 12 has more than 4 numbers"), std::string::npos);
  std::string text, binary;
  for (const Vec3f& p : points) {
    for (int k = 0; k < 3; ++k) {
      text += std::to_string(p[k]) + " ";
      append(binary, p[k]);
    }
    text += "\n";
  }
  const auto ply_of = [](const std::string& format, const std::string& count) {
    return "ply\nformat " + format + " 1.0\nelement vertex " + count +
           "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  };
  for (const std::string count : {"150", "199"}) {
    EXPECT_NE(refusal(ply_of("ascii", count) + text).find("goes on"), std::string::npos);
    EXPECT_NE(refusal(ply_of("binary_little_endian", count) + binary).find("goes on"),
              std::string::npos);
  }
  // Padding is none.
  const std::string zeros(512, '\0');
  for (const std::string& bytes :
       {pcd_ascii(points) + " \r\n\n", pcd_binary(points) + zeros, pcd_compressed(points) + zeros,
        ply_of("ascii", "200") + text + "\n",
        ply_of("binary_little_endian", "200") + binary + "\n"}) {
    EXPECT_EQ(read(bytes).points.size(), points.size());
  }
}

// 2^56 points of 2^8 bytes: none, in 64 bits.
TEST(CloudFile, RefusesAProductThatIsTooLargeForItsType) {
  const std::string header =
      "FIELDS x y z other\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 61\nWIDTH 268435456\nHEIGHT "
      "268435456\nDATA ";
  for (const std::string data : {"ascii\n", "binary\n", "binary_compressed\n"}) {
    EXPECT_NE(refusal(header + data + "abcdefgh").find("WIDTH times HEIGHT"), std::string::npos);
  }
}

TEST(CloudFile, BelievesNoHeaderThatPromisesMoreThanTheFile) {
  for (const std::string count : {"400000000", "4000000000", "18446744073709551615", "1e300"}) {
    const std::string xyz = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " + count +
                            "\nHEIGHT 1\nPOINTS " + count + "\nDATA ";
    for (const std::string data :
         {"ascii\n1 2 3\n", "binary\nabc", "binary_compressed\nabcdefgh"}) {
      EXPECT_FALSE(refusal(xyz + data).empty()) << count << " " << data;
    }
    const std::string vertices = "\nelement vertex " + count +
                                 "\nproperty float x\nproperty float y\nproperty float z\n"
                                 "end_header\n";
    EXPECT_FALSE(refusal("ply\nformat ascii 1.0" + vertices + "1 2 3\n").empty());
    EXPECT_FALSE(refusal("ply\nformat binary_little_endian 1.0" + vertices + "abc").empty());
    EXPECT_FALSE(refusal("ply\nformat binary_big_endian 1.0\nelement a " + count +
                         "\nproperty list uint double b" + vertices + "abc")
                     .empty());
  }
}

TEST(CloudFile, AnswersToDamageWithACloudOrOneLine) {
  const std::vector<std::string> sound = all_encodings(some_points(120));
  int read_whole = 0, refused = 0;
  for (std::uint64_t number = 0; number < 300; ++number) {
    RandomStream random(number, "damaged cloud");
    const std::string& bytes = sound[number % sound.size()];
    // Most of the damage where it hurts.
    const std::size_t head =
        number % 2 == 0 ? std::min<std::size_t>(bytes.size(), 300) : bytes.size();
    const std::string damaged =
        damage_bytes(bytes.substr(0, head), sound, random) + bytes.substr(head);
    try {
      const CloudFile cloud = read(damaged);
      EXPECT_LE(cloud.points.size(), 300 * damaged.size());
      ++read_whole;
    } catch (const ConfigError& error) {
      EXPECT_EQ(printable(error.what()), error.what());
      ++refused;
    }
  }
  EXPECT_GT(read_whole, 10);
  EXPECT_GT(refused, 10);
}

}  // namespace
}  // namespace arex::test

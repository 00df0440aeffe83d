#include "exemplar/perception/picture.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "exemplar/base/rng.hpp"

namespace exemplar::perception {
namespace {

using ::testing::HasSubstr;

Picture Gradient(int width, int height) {
  Picture picture{width, height, {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      picture.rgb.push_back(static_cast<std::uint8_t>(255 * x / width));
      picture.rgb.push_back(static_cast<std::uint8_t>(255 * y / height));
      picture.rgb.push_back(40);
    }
  }
  return picture;
}

TEST(Picture, PngComesBackExactly) {
  const Picture picture = Gradient(61, 37);
  const auto bytes = Encode(picture, "png");
  ASSERT_TRUE(bytes.ok());
  const Result<Picture> back = Decode(*bytes);
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->width, 61);
  EXPECT_EQ(back->height, 37);
  EXPECT_EQ(back->rgb, picture.rgb);
}

TEST(Picture, JpegComesBackNearly) {
  const Picture picture = Gradient(64, 48);
  const auto bytes = Encode(picture, "jpeg", 95);
  ASSERT_TRUE(bytes.ok());
  EXPECT_LT(bytes->size(), picture.rgb.size());
  const Result<Picture> back = Decode(*bytes);
  ASSERT_TRUE(back.ok());
  ASSERT_EQ(back->rgb.size(), picture.rgb.size());
  for (std::size_t i = 0; i < picture.rgb.size(); ++i) {
    EXPECT_LE(std::abs(static_cast<int>(picture.rgb[i]) - static_cast<int>(back->rgb[i])), 12);
  }
}

TEST(Picture, RefusesWhatCannotBeEncoded) {
  EXPECT_FALSE(Encode(Picture{2, 2, {1, 2, 3}}, "png").ok());
  EXPECT_FALSE(Encode(Picture{}, "png").ok());
  EXPECT_THAT(Encode(Gradient(4, 4), "gif").error().message, HasSubstr("\"gif\""));
  EXPECT_THAT(Encode(Gradient(4, 4), "jpeg", 0).error().message, HasSubstr("quality is 0"));
}

TEST(Picture, RubbishIsAnError) {
  EXPECT_FALSE(Decode({}).ok());
  Rng rng(1);
  for (int i = 0; i < 200; ++i) {
    std::vector<std::uint8_t> bytes(rng.Below(400) + 1);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(rng.Below(256));
    EXPECT_FALSE(Decode(bytes).ok());
  }
}

TEST(Picture, ACutFileIsAnErrorAndNotHalfAPicture) {
  for (const char* encoding : {"png", "jpeg"}) {
    const std::vector<std::uint8_t> whole = *Encode(Gradient(32, 24), encoding);
    for (std::size_t size = 1; size < whole.size(); ++size) {
      EXPECT_FALSE(Decode(std::span(whole).first(size)).ok()) << encoding << ' ' << size;
    }
  }
}

TEST(Picture, DamagedFilesNeverCrash) {
  Rng rng(2);
  const std::vector<std::uint8_t> sound = *Encode(Gradient(32, 24), "jpeg");
  for (int i = 0; i < 200; ++i) {
    std::vector<std::uint8_t> bytes = sound;
    // Not the header's sizes: a huge picture is a fair answer to them.
    bytes[bytes.size() / 2 + rng.Below(bytes.size() / 2 - 2)] ^= 0x55;
    const Result<Picture> picture = Decode(bytes);
    if (picture.ok()) {
      EXPECT_TRUE(picture->valid());
    }
  }
}

}  // namespace
}  // namespace exemplar::perception

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "drivers/cia406/cia406.h"
#include "tests/support/golden_file.h"

namespace axlecast::cia406 {
namespace {

using ::testing::HasSubstr;

std::vector<std::uint8_t> DataOf(std::string text) {
  const std::size_t pad = text.find('+');
  if (pad != std::string::npos) text.erase(pad);
  std::vector<std::uint8_t> data = GoldenBytes(text);
  if (pad != std::string::npos) data.resize(8);
  return data;
}

CanFrame FrameOf(std::uint32_t id, const std::vector<std::uint8_t>& data) {
  CanFrame frame{.id = id, .data = {}};
  frame.data.Append(Bytes(data));
  return frame;
}

nlohmann::ordered_json Decoded(std::uint32_t id, const std::vector<std::uint8_t>& data,
                               const DecodeSettings& settings = {}) {
  return Decode(settings, FrameOf(id, data)).value();
}

TEST(Cia406Codec, FramesAsOthersPrintThem) {
  for (const GoldenRow& row : GoldenRows(__FILE__, "frames.txt", 3)) {
    const auto id = static_cast<std::uint32_t>(std::stoul(row.columns[0], nullptr, 16));
    EXPECT_EQ(Decoded(id, DataOf(row.columns[1])).dump(), row.columns[2]) << row.where;
  }
}

TEST(Cia406Codec, APositionIsFourBytesLowFirst) {
  const DecodeSettings settings = {{"bits", "13"}, {"turn_bits", "12"}};
  EXPECT_EQ(
      Decoded(0x181, {0x01, 0x10, 0x00, 0x00}, settings).dump(),
      R"({"ok":true,"kind":"position","position":4097,"turns":0,"counts":4097,"angle_deg":180.0439453125,"node":1})");
  EXPECT_EQ(Decoded(0x181, {0x00, 0x00, 0x00, 0x02}, settings)["error"], "range");
  EXPECT_EQ(Decoded(0x181, {0x00, 0x00, 0x00})["error"], "short");
  EXPECT_EQ(Decoded(0x181, {0, 0, 0, 0, 0x01, 0x10})["status"], "0x1001");
  EXPECT_EQ(Decoded(0x2A0, {1, 0, 0, 0}, {{"cob_id", "0x2a0"}})["position"], 1);
  EXPECT_EQ(Decoded(0x181, {1, 0, 0, 0}, {{"cob_id", "0x2a0"}})["error"], "function");
}

TEST(Cia406Codec, ForeignFramesAreNotDescribed) {
  EXPECT_EQ(Decoded(0x580, {0x43, 0, 0, 0, 0, 0, 0, 0})["error"], "wrong_identity") << "no node 0";
  EXPECT_EQ(Decoded(0x585, {0x60, 0, 0, 0}, {{"node", "6"}})["error"], "wrong_identity");
  EXPECT_EQ(Decoded(0x185 | kCanExtended, {0, 0, 0, 0})["error"], "function");
  EXPECT_EQ(Decoded(0x301, {0, 0})["error"], "function");
  EXPECT_EQ(Decoded(0x000, {0x03, 0x01})["error"], "range");
  EXPECT_EQ(Decoded(0x081, {0, 0, 0})["error"], "short");
  EXPECT_EQ(Decoded(0x601, {0x00, 0, 0, 0, 0, 0, 0, 0})["error"], "function") << "a segment";
  EXPECT_THAT(ErrorText(Decode({{"bits", "40"}}, {})), HasSubstr("bits=40"));
  EXPECT_THAT(ErrorText(Decode({{"colour", "4"}}, {})), HasSubstr("colour"));
}

}  // namespace
}  // namespace axlecast::cia406

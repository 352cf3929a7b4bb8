#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/axlecast/device_data/device_access.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;

DeviceBackup Sample() {
  DeviceBackup backup{.machine = "press3",
                      .device = "axis1",
                      .bus = "rs485-0",
                      .family = "tformat",
                      .model = "ts5669n127",
                      .written_by = "axlecast 0.1.0",
                      .unix_us = 1'700'000'000'000'000,
                      .identity = 17,
                      .serial = "SN0042"};
  for (std::size_t address = 0; address < 20; ++address) backup.cells[address] = static_cast<std::uint8_t>(address);
  backup.cells[72] = 0xA1;
  backup.parameters = {{"log_interval", "0.5"}};
  return backup;
}

std::string ErrorOf(const std::string& text) {
  const auto backup = ParseDeviceBackup(text);
  return backup ? "" : backup.error().text;
}

TEST(DeviceBackup, AFileGivesBackWhatItWasMadeOf) {
  const auto backup = ParseDeviceBackup(ToFileText(Sample()));
  ASSERT_TRUE(backup);
  EXPECT_EQ(backup->device, "axis1");
  EXPECT_EQ(backup->identity, 17);
  EXPECT_EQ(backup->serial, "SN0042");
  EXPECT_EQ(backup->cells, Sample().cells);
  EXPECT_EQ(backup->parameters, Sample().parameters);
  EXPECT_EQ(ToFileText(*backup), ToFileText(Sample()));
}

// The sum of sha256sum over what `jq -cj 'del(.sha256)'` gives of the file.
TEST(DeviceBackup, TheSumIsOfTheCompactTextOfAllOthers) {
  DeviceBackup backup;
  backup.unix_us = 0;
  EXPECT_THAT(ToFileText(backup),
              HasSubstr("\"sha256\": \"213b81d1e9805c178bef6eb5e392fa3d3655e58fa0a5b9bd00891d8323229b80\""));
}

TEST(DeviceBackup, HowItIsSpacedDoesNotMatter) {
  const std::string compact = nlohmann::ordered_json::parse(ToFileText(Sample())).dump();
  EXPECT_EQ(ErrorOf(compact), "");
}

TEST(DeviceBackup, WhateverWasChangedIsNoticed) {
  const std::string text = ToFileText(Sample());
  for (const char* key : {"machine", "identity", "memory", "parameters", "alarms"}) {
    auto json = nlohmann::ordered_json::parse(text);
    json[key] = "changed";
    EXPECT_THAT(ErrorOf(json.dump()), HasSubstr("does not match its sha256")) << key;
    json.erase(key);
    EXPECT_THAT(ErrorOf(json.dump()), HasSubstr("does not match its sha256")) << key;
  }
  for (std::size_t end = 0; end + 2 < text.size(); end += 7) EXPECT_NE(ErrorOf(text.substr(0, end)), "");
}

TEST(DeviceBackup, WhatIsNoBackupIsSaid) {
  EXPECT_THAT(ErrorOf(""), HasSubstr("not JSON"));
  EXPECT_THAT(ErrorOf("[1]"), HasSubstr("no backup of axlecast"));
  EXPECT_THAT(ErrorOf("{\"axlecast_backup\": 2}"), HasSubstr("version is 2"));
  EXPECT_THAT(ErrorOf("{\"axlecast_backup\": \"1\"}"), HasSubstr("version is \"1\""));
  EXPECT_THAT(ErrorOf(std::string(kMaxBackupBytes + 1, ' ')), HasSubstr("longer than"));
  const std::string deep = std::string(500'000, '[') + std::string(500'000, ']');
  EXPECT_THAT(ErrorOf(R"({"axlecast_backup": 1, "alarms": )" + deep + '}'), HasSubstr("sha256"));
}

TEST(DeviceBackup, AnotherUnitIsToldByWhatBothSay) {
  device_info_t info{};
  info.identity = 17;
  info.serial = "SN0042";
  EXPECT_EQ(OtherUnit(Sample(), info), "");
  info.serial = "SN0043";
  EXPECT_THAT(OtherUnit(Sample(), info), HasSubstr("SN0043, the backup is of SN0042"));
  info.identity = 18;
  EXPECT_THAT(OtherUnit(Sample(), info), HasSubstr("identity is 18"));
  info.identity = -1;
  info.serial = "";
  EXPECT_EQ(OtherUnit(Sample(), info), "");  // unknown
}

TEST(DeviceBackup, ParametersThatTheFamilyDoesNotKnowAreRefused) {
  Family family;
  family.name = "tformat";
  const auto contents = ContentsOf(Sample(), family);
  ASSERT_FALSE(contents);
  EXPECT_THAT(contents.error().text, HasSubstr("no parameter 'log_interval'"));
}

}  // namespace

}  // namespace axlecast

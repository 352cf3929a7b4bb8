#include "core/messages/json/message_json.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <vector>

#include "core/messages/enum_names.h"
#include "core/messages/json/field.h"
#include "core/messages/message.h"

namespace axlecast {
namespace {

// Encodes through the runtime's own path.
position_t Position() {
  position_t position{};
  position.utime = 1'700'000'000'000'001;
  position.mono_ns = 5;
  position.boot_id = 0x00C0FFEE12345678;
  position.seq = 7;
  position.raw_counts = 42405;
  position.raw_turns = 34952;
  position.counts_per_turn = 131072;
  position.counts = -1;
  position.angle_rad = 0.5;
  position.value = -2.25;
  position.unit = position_t::UNIT_MM;
  position.speed_rad_s = std::numeric_limits<double>::quiet_NaN();
  position.flags = position_t::FLAG_VALID;
  return position;
}

TEST(MessageJson, IsFlatAndKeepsNamesAndOrder) {
  EXPECT_EQ(JsonLine(ToJson(Position())),
            "{\"utime\":1700000000000001,\"mono_ns\":5,\"boot_id\":\"00c0ffee12345678\",\"seq\":7,"
            "\"machine_id\":\"0000000000000000\",\"clock_id\":\"0000000000000000\","
            "\"tick\":0,\"time_uncertainty_ns\":0,\"missed\":0,\"raw_counts\":42405,\"raw_turns\":34952,"
            "\"counts_per_turn\":131072,\"counts\":-1,\"angle_rad\":0.5,\"value\":-2.25,\"unit\":4,"
            "\"unit_name\":\"mm\",\"speed_rad_s\":null,\"device_status\":0,\"datum_epoch\":0,\"flags\":1,"
            "\"flag_names\":[\"valid\"],\"spare\":[0,0]}");
}

TEST(MessageJson, NumbersHaveTheirNamesBesideThem) {
  position_t position = Position();
  position.flags = std::int32_t{position_t::FLAG_SIMULATED} | position_t::FLAG_VALID | 0x40000000 | INT32_MIN;
  EXPECT_EQ(ToJson(position)["flag_names"].dump(), R"(["valid","simulated","0xc0000000"])");
  position.unit = 100;
  EXPECT_TRUE(ToJson(position)["unit_name"].is_null()) << "of a newer version";

  device_info_t device{};
  device.state = device_info_t::STATE_DEGRADED;
  device.errors[device_info_t::ERROR_CHECKSUM] = 3;
  EXPECT_EQ(ToJson(device)["state_name"], "DEGRADED");
  EXPECT_EQ(ToJson(device)["errors_by_name"]["checksum"], 3);
  EXPECT_EQ(ToJson(device)["errors_by_name"].size(), 16U);

  motor_health_t motor{};
  motor.trip_factor[1] = motor_health_t::STATUS_OVERHEAT;
  EXPECT_EQ(ToJson(motor)["trip_factor_names"].dump(), R"([[],["overheat"],[]])");
  EXPECT_EQ(ToJson(motor)["status_names"].dump(), "[]");

  command_status_t status{};
  status.reason_code = command_status_t::REASON_NO_PERMIT;
  EXPECT_EQ(ToJson(status)["reason_name"], "no_permit");
  EXPECT_EQ(ToJson(status)["finding_name"], "none");
}

TEST(MessageJson, TheNamesAreTheWordsOfTablesAndPages) {
  position_t position{};
  device_info_t device{};
  bus_health_t bus{};
  alarm_entry_t alarm{};
  for (std::int8_t number = 0; number < 8; ++number) {
    position.unit = device.state = bus.state = alarm.state = alarm.severity = number;
    const auto same = [](const nlohmann::ordered_json& name, std::string_view word) {
      EXPECT_EQ(name.is_null() ? "?" : name.get<std::string>(), word);
    };
    same(ToJson(position)["unit_name"], UnitName(number));
    same(ToJson(device)["state_name"], DeviceStateName(number));
    same(ToJson(bus)["state_name"], BusStateName(number));
    same(ToJson(alarm)["state_name"], AlarmStateName(number));
    same(ToJson(alarm)["severity_name"], SeverityName(number));
  }
  for (int bit = 0; bit < 15; ++bit) {
    position.flags = 1 << bit;
    EXPECT_EQ(ToJson(position)["flag_names"][0], FlagNames(position.flags));
  }
}

TEST(MessageJson, InfinityIsNull) {
  position_t position = Position();
  position.value = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(ToJson(position)["value"].is_null());
}

TEST(MessageJson, ListsOfMessagesAndOfNumbers) {
  alarm_t alarm{};
  alarm.device = "axis1";
  alarm.n = 1;
  alarm.entries.resize(1);
  alarm.entries[0].code = 6;
  alarm.entries[0].name = "battery_error";
  const auto json = ToJson(alarm);
  EXPECT_EQ(json["entries"].size(), 1U);
  EXPECT_EQ(json["entries"][0]["name"], "battery_error");
  EXPECT_EQ(json["entries"][0]["code"], 6);

  trip_log_t trip{};
  trip.samples[6][19] = 1.5F;
  EXPECT_EQ(ToJson(trip)["samples"].size(), 7U);
  EXPECT_EQ(ToJson(trip)["samples"][6].size(), 20U);
  EXPECT_EQ(ToJson(trip)["samples"][6][19], 1.5);
}

TEST(MessageJson, IdsAndBytesAreHex) {
  wire_t wire{};
  wire.bus = "rs485-0";
  wire.n = 1;
  wire.records.resize(1);
  wire.records[0].len = 2;
  wire.records[0].data = {0x1A, 0xF0};
  EXPECT_EQ(ToJson(wire)["records"][0]["data"], "1af0");

  command_status_t status{};
  status.id[15] = 0xFF;
  status.driver_boot_id = -1;
  EXPECT_EQ(ToJson(status)["id"], "000000000000000000000000000000ff");
  EXPECT_EQ(ToJson(status)["driver_boot_id"], "ffffffffffffffff");
}

TEST(MessageJson, ShowsTheMessageWithinACommand) {
  command_body_t body{};
  body.device = "axis1";
  body.operation = "clear_errors";
  command_t command{};
  command.body = Encoded(body);
  command.body_size = static_cast<std::int16_t>(command.body.size());
  EXPECT_EQ(ToJson(command)["body_decoded"]["operation"], "clear_errors");

  command.body.pop_back();
  command.body_size = static_cast<std::int16_t>(command.body.size());
  EXPECT_TRUE(ToJson(command)["body_decoded"].is_null());
  EXPECT_TRUE(ToJson(command)["body"].is_string());
}

TEST(MessageJson, TellsTheTypeByItsFingerprint) {
  std::string type;
  const auto json = DecodeToJson(Encoded(Position()), &type);
  ASSERT_TRUE(json);
  EXPECT_EQ(type, "position_t");
  EXPECT_EQ(*json, ToJson(Position()));
}

TEST(MessageJson, ReadsAHeadAlone) {
  std::vector<std::uint8_t> message = Encoded(Position());
  const auto head = HeadOf(message);
  ASSERT_TRUE(head);
  EXPECT_EQ(head->utime, 1'700'000'000'000'001);
  EXPECT_EQ(head->mono_ns, 5);
  EXPECT_EQ(head->boot_id, 0x00C0FFEE12345678);
  EXPECT_EQ(head->seq, 7);
  for (std::size_t size = 0; size < 40; ++size) EXPECT_FALSE(HeadOf(Bytes(message).first(size))) << size;
  message[0] ^= 1U;
  EXPECT_FALSE(HeadOf(message)) << "none of ours";
  EXPECT_FALSE(HeadOf(Encoded(alarm_entry_t{}))) << "a type without a head";
}

// That messages agree with their schemas in whole is checked in tests/convert, by somebody else's validator.
TEST(MessageJson, SchemaNamesTheFieldsInTheirOrder) {
  const MessageType* const type = FindMessageType(Encoded(Position()));
  ASSERT_NE(type, nullptr);
  const auto properties = nlohmann::ordered_json::parse(type->schema).at("properties");
  const nlohmann::ordered_json json = ToJson(Position());
  ASSERT_EQ(properties.size(), json.size());
  auto field = json.begin();
  for (const auto& [name, property] : properties.items()) EXPECT_EQ(name, (field++).key());
  EXPECT_EQ(properties["spare"]["maxItems"], 2);
  EXPECT_EQ(FindMessageType(Bytes()), nullptr);
}

TEST(MessageJson, MalformedMessagesAreNone) {
  std::string type;
  std::vector<std::uint8_t> bytes = Encoded(Position());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(DecodeToJson(Bytes(bytes).first(size), &type)) << size;
  }
  bytes[0] ^= 1U;
  EXPECT_FALSE(DecodeToJson(bytes, &type));
}

TEST(MessageJson, LineMendsTextThatIsNotUtf8) {
  alarm_t alarm{};
  alarm.device = "\xFF\xFE";
  EXPECT_NE(JsonLine(ToJson(alarm)).find("\xEF\xBF\xBD"), std::string::npos);
}

// Unicode's bidi controls, C1 and DEL are valid in JSON as they are, and steer the terminal that a line is printed on.
TEST(MessageJson, LineEscapesWhatSteersATerminal) {
  alarm_t alarm{};
  alarm.device =
      "a\x7f\xC2\x9B"
      "b\xE2\x80\xAE\x1b\xC2\xB5";
  const std::string line = JsonLine(ToJson(alarm));
  EXPECT_NE(line.find(R"(a\u007f\u009bb\u202e\u001b)"
                      "\xC2\xB5"),
            std::string::npos)
      << line;
  EXPECT_EQ(nlohmann::json::parse(line).at("device"), alarm.device);
}

TEST(ParseOutsideJson, WhatIsNestedDeeperIsLeftOut) {
  const std::string deep(1'000'000, '[');
  EXPECT_TRUE(ParseOutsideJson(deep).is_discarded());
  const std::string text = R"({"a":)" + deep + std::string(deep.size(), ']') + R"(,"b":[{"c":1}]})";
  const nlohmann::ordered_json json = ParseOutsideJson(text);
  EXPECT_EQ(json["b"], nlohmann::ordered_json::parse(R"([{"c":1}])"));
  EXPECT_LT(JsonLine(json).size(), 100U);
}

}  // namespace
}  // namespace axlecast

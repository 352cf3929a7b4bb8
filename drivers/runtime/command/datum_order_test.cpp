#include "drivers/runtime/command/axis_commands.h"

#include <gmock/gmock.h>

#include <axlecast/command_status_t.hpp>
#include <axlecast/position_t.hpp>

#include "drivers/runtime/command/operations_fixture.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using Status = command_status_t;

TEST_F(OperationsTest, SetDatumMakesThePresentPositionReadTheValue) {
  bus_.devices[0].unit = position_t::UNIT_COUNT;
  Online(1'000);
  const std::int32_t epoch = channel_.summary().datum_epoch;
  const driver_status_t answer = Do(MakeOrder("set_datum", {{"value", "0"}}));
  EXPECT_EQ(answer.state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(answer.verified, 1);
  EXPECT_EQ(answer.epoch_after, epoch + 1);
  EXPECT_NEAR(channel_.summary().value, 0, 1e-9);
  ASSERT_EQ(answer.n_changes, 3);
  EXPECT_EQ(answer.changes[0].key, "value");
  EXPECT_EQ(answer.changes[0].after, "0");
  EXPECT_EQ(answer.changes[1].key, "datum_counts");
  EXPECT_EQ(answer.changes[1].before, "none");
  EXPECT_EQ(answer.changes[1].after, std::to_string(channel_.summary().datum->counts));
  EXPECT_EQ(answer.changes[2].key, "identity");
  EXPECT_EQ(answer.changes[2].after, "");
  EXPECT_EQ(channel_.summary().datum->utime, time_.Utime(clock_.Now()));
}

TEST_F(OperationsTest, ADatumOfAnEarlierDayComesBackAsOld) {
  Online(1'000);
  const std::int64_t earlier = time_.Utime(clock_.Now()) - 86'400'000'000;
  const driver_status_t answer = Do(MakeOrder("set_datum", {{"counts", "10"}, {"utime", std::to_string(earlier)}}));
  EXPECT_EQ(answer.state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(channel_.summary().datum, (Reference::Datum{10, earlier}));
  for (const char* text : {"", "1.5", "-1", "x", "99999999999999999999"}) {
    EXPECT_EQ(Do(MakeOrder("set_datum", {{"counts", "1"}, {"utime", text}})).reason_code,
              Status::REASON_BAD_ARGUMENT)
        << text;
  }
}

TEST_F(OperationsTest, ADatumOfAnotherEncoderIsRefused) {
  Online();
  const std::vector<argument_t> datum = {{"counts", "10"}, {"identity", "17 SN0042"}};
  driver_status_t answer = Do(MakeOrder("set_datum", datum));
  EXPECT_EQ(answer.reason_code, Status::REASON_DEVICE_OFFLINE);
  EXPECT_THAT(answer.text, HasSubstr("not told its identity yet"));
  channel_.OnIdentity(17, "SN0043", "");
  answer = Do(MakeOrder("set_datum", datum));
  EXPECT_EQ(answer.reason_code, Status::REASON_WRONG_IDENTITY);
  EXPECT_THAT(answer.text, HasSubstr("is 17 SN0043, and the datum is for 17 SN0042"));
  EXPECT_FALSE(channel_.summary().datum);
  channel_.OnIdentity(17, "SN0042", "");
  answer = Do(MakeOrder("set_datum", datum));
  EXPECT_EQ(answer.state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(answer.changes.at(2).after, "17 SN0042");
}

TEST_F(OperationsTest, AClearedDatumIsNone) {
  Online(1'000);
  EXPECT_EQ(Do(MakeOrder("clear_datum")).reason_code, Status::REASON_NO_DATUM);
  Send(MakeOrder("set_datum", {{"counts", "400"}}));
  const std::int32_t epoch = channel_.summary().datum_epoch;
  const driver_status_t answer = Do(MakeOrder("clear_datum"));
  EXPECT_EQ(answer.state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(answer.verified, 1);
  EXPECT_EQ(answer.epoch_after, epoch + 1);
  EXPECT_EQ(answer.changes.at(1).before, "400");
  EXPECT_EQ(answer.changes.at(1).after, "none");
  EXPECT_FALSE(channel_.summary().datum);
  clock_.Advance(kMillisecond);
  channel_.OnSample({.at = {clock_.Now(), clock_.Now()}, .counts = 1'000});
  const position_t position = sink_.All<position_t>("POSITION/axis1").back();
  EXPECT_EQ(position.counts, 1'000);
  EXPECT_EQ(position.flags & position_t::FLAG_REFERENCED, 0);
}

class FileDatumTest : public OperationsTest {
 protected:
  static BusConfig Bus() {
    BusConfig bus = PolledBus(1);
    bus.devices[0].datum_counts = 70;
    return bus;
  }
  FileDatumTest() : OperationsTest(Bus()) {}
};

TEST_F(FileDatumTest, TheFilesDatumCannotBeClearedAndComesBack) {
  Online(1'000);
  driver_status_t answer = Do(MakeOrder("clear_datum"));
  EXPECT_EQ(answer.reason_code, Status::REASON_NOT_PERMITTED);
  EXPECT_THAT(answer.text, HasSubstr("70 counts, is of the machine's file"));
  Send(MakeOrder("set_datum", {{"counts", "400"}}));
  answer = Do(MakeOrder("clear_datum"));
  EXPECT_EQ(answer.state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(answer.changes.at(1).after, "70");
  EXPECT_EQ(channel_.summary().datum->counts, 70);
}

TEST_F(OperationsTest, SetDatumTakesCountsEvenBeforeTheDeviceAnswers) {
  const driver_status_t answer = Do(MakeOrder("set_datum", {{"counts", "-12345"}}));
  EXPECT_EQ(answer.state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(Do(MakeOrder("set_datum", {{"value", "1"}})).reason_code, Status::REASON_DEVICE_OFFLINE);
}

TEST_F(OperationsTest, SetDatumRefusesWhatIsNoNumber) {
  Online();
  for (const char* text : {"", "x", "1x", "nan", "inf", "1e300", " 1"}) {
    EXPECT_EQ(Do(MakeOrder("set_datum", {{"value", text}})).reason_code, Status::REASON_BAD_ARGUMENT) << text;
  }
  for (const char* text : {"1.5", "9223372036854775807", "--1"}) {
    EXPECT_EQ(Do(MakeOrder("set_datum", {{"counts", text}})).reason_code, Status::REASON_BAD_ARGUMENT) << text;
  }
  EXPECT_EQ(Do(MakeOrder("set_datum")).reason_code, Status::REASON_BAD_ARGUMENT);
  EXPECT_EQ(Do(MakeOrder("set_datum", {{"value", "1"}, {"counts", "1"}})).reason_code, Status::REASON_BAD_ARGUMENT);
}

TEST_F(OperationsTest, TheBridgeTellsThatTheReferenceWasLost) {
  Online();
  EXPECT_EQ(Do(MakeOrder("mark_reference_lost")).state, Status::STATE_SUCCEEDED);
  EXPECT_TRUE(channel_.summary().reference_lost);
}

}  // namespace
}  // namespace axlecast

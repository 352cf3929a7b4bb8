#include "tools/mqtt/sparkplug/edge_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <set>

#include "tests/support/temporary_folder.h"
#include "tools/mqtt/sparkplug/sparkplug_fixture.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Kind = BrokerEvent::Kind;

// A broker in the test's hand. `answers`: it confirms what it is asked to.
class FakeBroker final : public BrokerLink {
 public:
  void Connect(const BrokerMessage& message) override {
    ++connects;
    wills.push_back(message);
    events.clear();
    if (answers) events.push_back({.kind = Kind::kConnected});
  }
  void Drop() override { events.clear(); }
  void Disconnect(bool publish_will) override {
    ++disconnects;
    ended_with_will = publish_will;
  }
  int Send(const BrokerMessage& message) override {
    sent.push_back(Read(message));
    if (answers && message.qos == 1) events.push_back({.kind = Kind::kTaken, .message = next_number});
    return next_number++;
  }
  int Subscribe(const std::string& filter) override {
    subscriptions.push_back(filter);
    if (answers) events.push_back({.kind = Kind::kTaken, .message = next_number});
    return next_number++;
  }
  std::vector<BrokerEvent> Poll() override { return std::exchange(events, {}); }

  bool answers = true;
  int connects = 0;
  int disconnects = 0;
  bool ended_with_will = false;
  int next_number = 1;
  std::vector<BrokerMessage> wills;
  std::vector<std::string> subscriptions;
  std::vector<ReadPayload> sent;
  std::vector<BrokerEvent> events;
};

class EdgeSessionTest : public ::testing::Test {
 protected:
  explicit EdgeSessionTest(const std::string& primary_host = "") : primary_host_(primary_host) { Start(); }

  // A new process; the one before was killed.
  void Start() {
    session_.reset();
    log_.reset();
    SampleLogSettings settings;
    settings.folder = folder_.path();
    settings.repeat_us = repeat_us_;
    log_.emplace(settings);
    const Result<> opened = log_->Open();
    ASSERT_TRUE(opened) << opened.error().text;
    sequence_.emplace(folder_.path() + "/bdseq");
    node_.emplace(SparkplugMachine(), SparkplugTopics("plant", "press3", primary_host_), "1.0", now_);
    session_.emplace(link_, *log_, *node_, *sequence_, [] { return 100 * kMillisecond; });
  }
  [[nodiscard]] Timestamp Now() const { return {now_, kStartUtime + now_ / 1'000}; }
  void Step(MonoNs after = 0) {
    now_ += after;
    // Several calls: the fake broker answers in the next one.
    for (int i = 0; i < 4; ++i) static_cast<void>(session_->Step(Now()));
  }
  void Happens(BrokerEvent event) {
    link_.events.push_back(std::move(event));
    Step();
  }
  void Sample(const std::string& channel, const std::vector<std::uint8_t>& message) {
    node_->OnHeard(channel, now_);
    session_->OnSample(channel, message, Now());
  }
  void Position(double value, const std::string& device = "axis1") {
    Sample("POSITION/" + device, PositionMessage(seq_++, value, Now().utime));
  }
  void State(std::int8_t state, const std::string& device = "axis1") {
    Sample("DEVICE/" + device, DeviceMessage(state, Now().utime, device));
  }
  // Both devices are there, so that none falls silent; time advances in steps of 1 s.
  void Run(int seconds) {
    for (int i = 0; i < seconds; ++i) {
      for (const char* device : {"axis1", "axis2"}) node_->OnHeard(std::string("DEVICE/") + device, now_);
      Step(kSecond);
    }
  }
  void Request(const std::string& name = "Node Control/Rebirth", bool value = true, bool retained = false) {
    const SparkplugPayload payload{.timestamp_ms = 1,
                                   .seq = std::nullopt,
                                   .metrics = {{.name = name, .type = SparkplugType::kBoolean, .value = value}}};
    Happens({.kind = Kind::kReceived,
             .text = EncodePayload(payload),
             .topic = "spBv1.0/plant/NCMD/press3",
             .retained = retained});
  }
  void HostIs(bool online, std::int64_t timestamp_ms, const std::string& host = "scada1") {
    Happens({.kind = Kind::kReceived,
             .text = std::string("{\"online\":") + (online ? "true" : "false") +
                     ",\"timestamp\":" + std::to_string(timestamp_ms) + "}",
             .topic = "spBv1.0/STATE/" + host});
  }
  [[nodiscard]] std::vector<std::string> Kinds() const {
    std::vector<std::string> kinds;
    for (const ReadPayload& payload : link_.sent) kinds.push_back(payload.Kind());
    return kinds;
  }
  // Position/Seq of all samples that were sent since the births, which `births` gives the alias of.
  [[nodiscard]] std::vector<std::uint64_t> Sent(bool historical, const std::string& device = "axis1") const {
    std::vector<std::uint64_t> numbers;
    std::optional<std::uint64_t> alias;
    for (const ReadPayload& payload : link_.sent) {
      if (payload.Kind() == "DBIRTH/" + device) alias = payload.Find("Position/Seq")->alias;
      if (payload.Kind() != "DDATA/" + device) continue;
      for (const ReadMetric& metric : payload.metrics) {
        if (metric.alias == alias && metric.is_historical == historical) numbers.push_back(metric.number.value());
      }
    }
    return numbers;
  }

  TemporaryFolder folder_;
  std::string primary_host_;
  std::int64_t repeat_us_ = 0;
  MonoNs now_ = 1'000 * kSecond;
  std::int64_t seq_ = 0;
  FakeBroker link_;
  std::optional<SampleLog> log_;
  std::optional<BirthSequence> sequence_;
  std::optional<EdgeNode> node_;
  std::optional<EdgeSession> session_;
};

TEST_F(EdgeSessionTest, TheWillIsNdeathWithBdSeqAndWithoutSeq) {
  Step();
  ASSERT_EQ(link_.wills.size(), 1U);
  EXPECT_EQ(link_.wills[0].qos, 1);
  const ReadPayload will = Read(link_.wills[0]);
  EXPECT_EQ(will.topic, "spBv1.0/plant/NDEATH/press3");
  EXPECT_FALSE(will.retain);
  EXPECT_FALSE(will.seq);
  ASSERT_EQ(will.metrics.size(), 1U);
  EXPECT_EQ(will.metrics[0].name, "bdSeq");
  EXPECT_EQ(will.metrics[0].datatype, 4U) << "Int64";
  EXPECT_EQ(will.metrics[0].number, 0U);
}

TEST_F(EdgeSessionTest, SubscribesAndThenSendsTheBirths) {
  link_.answers = false;
  Step();
  Happens({.kind = Kind::kConnected});
  EXPECT_THAT(link_.subscriptions, ElementsAre("spBv1.0/plant/NCMD/press3"));
  EXPECT_THAT(Kinds(), IsEmpty()) << "the subscription is not confirmed";
  Happens({.kind = Kind::kTaken, .message = 1});
  EXPECT_THAT(Kinds(), ElementsAre("NBIRTH", "DBIRTH/axis1", "DBIRTH/axis2"));
  for (std::size_t i = 0; i < link_.sent.size(); ++i) {
    const ReadPayload& birth = link_.sent[i];
    EXPECT_EQ(birth.seq, i);
    EXPECT_EQ(birth.qos, 0);
    EXPECT_FALSE(birth.retain);
    EXPECT_EQ(birth.timestamp_ms, static_cast<std::uint64_t>(Now().utime / 1'000));
    std::uint64_t time = 0;
    for (const ReadMetric& metric : birth.metrics) {
      EXPECT_FALSE(metric.name.empty());
      EXPECT_NE(metric.datatype, 0U) << metric.name;
      EXPECT_GE(metric.timestamp_ms, time) << metric.name;
      time = metric.timestamp_ms;
    }
  }
}

TEST_F(EdgeSessionTest, NbirthHasBdSeqOfItsWillAndRebirthWithoutAlias) {
  Step();
  const ReadPayload& birth = link_.sent.at(0);
  const ReadMetric* const rebirth = birth.Find("Node Control/Rebirth");
  ASSERT_NE(rebirth, nullptr);
  EXPECT_EQ(rebirth->datatype, 11U) << "Boolean";
  EXPECT_EQ(rebirth->number, 0U);
  EXPECT_FALSE(rebirth->alias);
  EXPECT_EQ(birth.Find("bdSeq")->number, Read(link_.wills[0]).metrics[0].number);
  EXPECT_EQ(birth.Find("Version")->text, "1.0");
}

TEST_F(EdgeSessionTest, AliasesAreUniqueOverTheNode) {
  Step();
  std::set<std::uint64_t> aliases;
  std::size_t metrics = 0;
  for (const ReadPayload& birth : link_.sent) {
    for (const ReadMetric& metric : birth.metrics) {
      if (metric.name == "bdSeq" || metric.name == "Node Control/Rebirth") continue;
      ASSERT_TRUE(metric.alias) << metric.name;
      aliases.insert(*metric.alias);
      ++metrics;
    }
  }
  EXPECT_EQ(aliases.size(), metrics);
  EXPECT_GT(metrics, 80U);
}

TEST_F(EdgeSessionTest, DataHasOnlyWhatChangedByAlias) {
  Step();
  Position(1);
  Position(2);
  ASSERT_THAT(Kinds(), ElementsAre("NBIRTH", "DBIRTH/axis1", "DBIRTH/axis2", "DBIRTH/axis1", "DDATA/axis1"))
      << "the first position brings the boot id, which is in births only";
  const ReadPayload& data = link_.sent.back();
  EXPECT_EQ(data.qos, 0);
  EXPECT_EQ(data.seq, 4U);
  ASSERT_EQ(data.metrics.size(), 3U) << "value, counts, seq";
  for (const ReadMetric& metric : data.metrics) {
    EXPECT_EQ(metric.name, "");
    EXPECT_NE(metric.datatype, 0U);
    EXPECT_FALSE(metric.is_historical);
  }
  const ReadMetric* const value = data.Find(link_.sent[3].Find("Position/Value")->alias);
  EXPECT_EQ(value->real, 2.0);
  EXPECT_EQ(value->Quality(), 192U);
}

TEST_F(EdgeSessionTest, SeqWrapsAfter255) {
  Step();
  for (int i = 0; i < 300; ++i) {
    Position(i);
    Run(1);
  }
  ASSERT_GT(link_.sent.size(), 300U);
  for (std::size_t i = 0; i < link_.sent.size(); ++i) EXPECT_EQ(link_.sent[i].seq, i % 256);
}

TEST_F(EdgeSessionTest, ARebirthStopsDataAndRepeatsBdSeq) {
  Step();
  State(device_info_t::STATE_ONLINE);
  Position(1);
  Run(1);
  link_.sent.clear();
  Request();
  Position(2);
  Position(3);
  EXPECT_THAT(Kinds(), IsEmpty()) << "data stops at once";
  Step(100 * kMillisecond);
  ASSERT_THAT(Kinds(), ElementsAre("NBIRTH", "DBIRTH/axis1", "DBIRTH/axis2", "DDATA/axis1"));
  EXPECT_EQ(link_.sent[0].Find("bdSeq")->number, 0U);
  EXPECT_EQ(link_.sent[0].seq, 0U);
  EXPECT_THAT(Sent(true), ElementsAre(1U, 2U)) << "what was selected meanwhile";
  EXPECT_EQ(link_.connects, 1);
  EXPECT_EQ(session_->counts().rebirths, 1);
}

TEST_F(EdgeSessionTest, AtMostOneRebirthIn5Seconds) {
  Step();
  for (int i = 0; i < 100; ++i) {
    Request();
    for (const char* device : {"axis1", "axis2"}) node_->OnHeard(std::string("DEVICE/") + device, now_);
    Step(100 * kMillisecond);
  }
  const std::vector<std::string> kinds = Kinds();
  EXPECT_LE(std::count(kinds.begin(), kinds.end(), "NBIRTH"), 4) << "the first, and 2 or 3 in 10 s";
  EXPECT_GE(std::count(kinds.begin(), kinds.end(), "NBIRTH"), 3);
}

TEST_F(EdgeSessionTest, EveryOtherCommandIsIgnoredAndCounted) {
  Step();
  link_.sent.clear();
  Request("Node Control/Reboot");
  Request("Position/Value");
  Request("Node Control/Rebirth", false);
  Request("Node Control/Rebirth", true, true);
  Happens({.kind = Kind::kReceived, .text = "garbage", .topic = "spBv1.0/plant/NCMD/press3"});
  Happens({.kind = Kind::kReceived, .text = "", .topic = "spBv1.0/plant/DCMD/press3/axis1"});
  Step(6 * kMillisecond);
  EXPECT_THAT(Kinds(), IsEmpty());
  EXPECT_EQ(session_->counts().ignored, 6);
}

TEST_F(EdgeSessionTest, ADeviceThatIsOfflineDiesAndIsBornAgain) {
  Step();
  State(device_info_t::STATE_ONLINE);
  link_.sent.clear();
  State(device_info_t::STATE_OFFLINE);
  Step();
  ASSERT_THAT(Kinds(), ElementsAre("DDATA/axis1", "DDEATH/axis1"));
  EXPECT_TRUE(link_.sent[1].seq);
  EXPECT_THAT(link_.sent[1].metrics, IsEmpty());
  link_.sent.clear();
  Position(1);
  State(device_info_t::STATE_STARTING);
  EXPECT_THAT(Kinds(), IsEmpty());
  State(device_info_t::STATE_ONLINE);
  ASSERT_THAT(Kinds(), ElementsAre("DBIRTH/axis1"));
  EXPECT_EQ(link_.sent[0].Find("State")->text, "ONLINE");
  EXPECT_EQ(link_.sent[0].Find("Position/Value")->real, 1.0);
}

TEST_F(EdgeSessionTest, ASilentDeviceHasStaleQualityAndDies) {
  Step();
  Position(1);
  Position(2);
  link_.sent.clear();
  for (int i = 0; i < 6; ++i) {
    node_->OnHeard("DEVICE/axis2", now_);
    Step(kSecond);
  }
  ASSERT_THAT(Kinds(), ElementsAre("DDATA/axis1", "DDEATH/axis1"));
  ASSERT_EQ(link_.sent[0].metrics.size(), 1U);
  EXPECT_EQ(link_.sent[0].metrics[0].Quality(), 500U);
}

TEST_F(EdgeSessionTest, AnAlarmThatTheBirthDoesNotHaveNeedsANewBirth) {
  Step();
  link_.sent.clear();
  Sample("ALARM/axis1", AlarmMessage({"overheat"}, Now().utime));
  ASSERT_THAT(Kinds(), ElementsAre("DBIRTH/axis1"));
  EXPECT_EQ(link_.sent[0].Find("Alarm/overheat/Active")->number, 1U);
  EXPECT_EQ(link_.sent[0].Find("Alarm/reference_lost/Active")->number, 0U);
  const auto alias = link_.sent[0].Find("Alarm/overheat/Active")->alias;
  link_.sent.clear();
  Sample("ALARM/axis1", AlarmMessage({}, Now().utime));
  ASSERT_THAT(Kinds(), ElementsAre("DDATA/axis1"));
  EXPECT_EQ(link_.sent[0].Find(alias)->number, 0U);
}

TEST_F(EdgeSessionTest, WhatWaitedIsHistoricalWithItsOwnTimesAndAfterTheBirths) {
  for (int i = 0; i < 500; ++i) {
    Position(i);
    now_ += 10 * kMillisecond;
  }
  const std::int64_t first_ms = (kStartUtime + 1'000 * INT64_C(1'000'000)) / 1'000;
  EXPECT_EQ(link_.connects, 0);
  Step();
  Run(1);
  EXPECT_EQ(Kinds()[0], "NBIRTH");
  EXPECT_EQ(Kinds()[1], "DBIRTH/axis1");
  EXPECT_EQ(Kinds()[2], "DBIRTH/axis2");
  const auto sent = Sent(true);
  ASSERT_EQ(sent.size(), 500U);
  for (std::size_t i = 0; i < sent.size(); ++i) EXPECT_EQ(sent[i], i);
  EXPECT_EQ(link_.sent[3].metrics[0].timestamp_ms, static_cast<std::uint64_t>(first_ms));
  for (std::size_t i = 0; i < link_.sent.size(); ++i) {
    EXPECT_EQ(link_.sent[i].seq, i % 256);
    EXPECT_LE(link_.sent[i].metrics.size(), EdgeNode::kMaxMetrics);
  }
  EXPECT_TRUE(session_->caught_up());
  Position(1000);
  EXPECT_THAT(Sent(false), ElementsAre(500U));
}

TEST_F(EdgeSessionTest, NoMoreThanAWindowIsSentWithoutAConfirmation) {
  link_.answers = false;
  Step();
  Happens({.kind = Kind::kConnected});
  Happens({.kind = Kind::kTaken, .message = 1});
  for (int i = 0; i < 1'000; ++i) Position(i);
  Step();
  EXPECT_LE(link_.sent.size(), static_cast<std::size_t>(EdgeSession::kWindow) + 4);
  const auto live = Sent(false);
  link_.answers = true;
  ASSERT_EQ(link_.sent.at(2).Kind(), "DBIRTH/axis2");
  Happens({.kind = Kind::kTaken, .message = 5});  // of the subscription after the births
  Run(3);
  auto all = Sent(false);
  EXPECT_EQ(all, live) << "the rest is historical";
  for (const std::uint64_t number : Sent(true)) all.push_back(number);
  EXPECT_EQ(std::set<std::uint64_t>(all.begin(), all.end()).size(), 999U)
      << "number 0 was in the birth with the boot id";
  EXPECT_TRUE(session_->caught_up());
}

TEST_F(EdgeSessionTest, UnconfirmedSamplesAreSentAgainAfterALostConnection) {
  Step();
  Position(0);
  Run(2);
  const std::int64_t confirmed = log_->confirmed();
  EXPECT_GT(confirmed, 0);
  link_.answers = false;
  Position(1);
  Position(2);
  Step(kSecond);
  link_.sent.clear();
  Happens({.kind = Kind::kDown, .text = "Connection reset"});
  EXPECT_EQ(log_->confirmed(), confirmed);
  EXPECT_EQ(session_->status().problem, "Connection reset");
  link_.answers = true;
  Run(2);
  EXPECT_THAT(Sent(true), ElementsAre(1U, 2U));
  EXPECT_GT(log_->confirmed(), confirmed);
  EXPECT_EQ(link_.wills.size(), 2U);
  EXPECT_EQ(Read(link_.wills[1]).metrics[0].number, 1U) << "bdSeq counts connections";
}

TEST_F(EdgeSessionTest, AfterAKillWhatWasNotConfirmedIsSentAndBdSeqGoesOn) {
  Step();
  Position(0);
  Run(2);
  link_.answers = false;
  Position(1);
  Step();
  Start();
  Position(2);
  link_.answers = true;
  link_.sent.clear();
  Step();
  EXPECT_THAT(Sent(true), ElementsAre(1U, 2U));
  EXPECT_EQ(Read(link_.wills.back()).metrics[0].number, 1U);
  EXPECT_EQ(link_.sent[0].Find("bdSeq")->number, 1U);
}

class RepeatingSessionTest : public EdgeSessionTest {
 protected:
  RepeatingSessionTest() {
    repeat_us_ = 2'500'000;
    Start();
  }
};

TEST_F(RepeatingSessionTest, TheLastSecondsAreSentAgainEvenIfTheBrokerHadThem) {
  Step();
  for (int i = 0; i < 10; ++i) {
    Position(i);
    Run(1);
  }
  link_.sent.clear();
  Happens({.kind = Kind::kDown, .text = "gone"});
  Run(1);
  EXPECT_THAT(Sent(true), ElementsAre(7U, 8U, 9U));
}

TEST_F(EdgeSessionTest, AnOrderlyEndPublishesNdeathAndDisconnects) {
  Step();
  Position(1);
  session_->End(Now());
  Step();
  EXPECT_EQ(Kinds().back(), "NDEATH");
  EXPECT_EQ(link_.sent.back().qos, 1);
  EXPECT_FALSE(link_.sent.back().seq);
  EXPECT_EQ(link_.sent.back().metrics[0].number, 0U);
  EXPECT_EQ(link_.disconnects, 1);
  EXPECT_TRUE(link_.ended_with_will) << "MQTT 5: reason 4";
  EXPECT_TRUE(session_->ended());
  EXPECT_EQ(log_->confirmed(), log_->next() - 1) << "but for the mark itself";
}

TEST_F(EdgeSessionTest, AnEndWithoutABrokerIsAtOnceAndKeepsWhatWaits) {
  link_.answers = false;
  Position(1);
  Step();
  session_->End(Now());
  EXPECT_TRUE(session_->ended());
  EXPECT_EQ(log_->Read(log_->Resume(), INT64_MAX, 9).size(), 1U);
}

TEST_F(EdgeSessionTest, ThreeTakeoversInAMinuteEndItWithTheCause) {
  for (int i = 0; i < 3; ++i) {
    Step(9 * kSecond);
    Happens({.kind = Kind::kDown, .text = "taken over", .taken_over = true});
  }
  EXPECT_TRUE(session_->ended());
  EXPECT_THAT(session_->failure(), HasSubstr("client_id"));
}

TEST_F(EdgeSessionTest, TakeoversThatAreFarApartOrOtherEndsDoNot) {
  for (int i = 0; i < 6; ++i) {
    Step(31 * kSecond);
    Happens({.kind = Kind::kDown, .text = "taken over", .taken_over = true});
  }
  for (int i = 0; i < 6; ++i) {
    Step(9 * kSecond);
    ASSERT_TRUE(session_->born());
    Step(11 * kSecond);
    Happens({.kind = Kind::kDown, .text = "lost after 11 s"});
  }
  EXPECT_FALSE(session_->ended());
}

TEST_F(EdgeSessionTest, FiveShortSessionsInAMinuteEndItUnlessAnAttemptFails) {
  const auto lose = [this] {
    Step(9 * kSecond);
    ASSERT_TRUE(session_->born());
    Happens({.kind = Kind::kDown, .text = "lost"});
  };
  for (int i = 0; i < 4; ++i) lose();
  EXPECT_FALSE(session_->ended());
  link_.answers = false;
  Step(9 * kSecond);
  Happens({.kind = Kind::kDown, .text = "Connection refused"});
  link_.answers = true;
  for (int i = 0; i < 4; ++i) lose();
  EXPECT_FALSE(session_->ended()) << "the broker itself was away";
  lose();
  EXPECT_TRUE(session_->ended());
  EXPECT_THAT(session_->failure(), HasSubstr("client_id"));
}

TEST_F(EdgeSessionTest, ABrokerThatDoesNotAnswerOrConfirmIsAway) {
  link_.answers = false;
  Step();
  Step(EdgeSession::kAnswer);
  EXPECT_THAT(session_->status().problem, HasSubstr("does not answer"));
  link_.answers = true;
  Step(kSecond);
  Step();
  EXPECT_TRUE(session_->born());
  link_.answers = false;
  Position(1);
  Run(40);
  EXPECT_EQ(session_->status().connections, 1);
  EXPECT_FALSE(session_->born());
}

TEST_F(EdgeSessionTest, ARefusedSubscriptionNamesWhatToAllow) {
  link_.answers = false;
  Step();
  Happens({.kind = Kind::kConnected});
  Happens({.kind = Kind::kRefused, .message = 1, .text = "Not authorized"});
  EXPECT_THAT(session_->status().problem, HasSubstr("spBv1.0/plant/NCMD/press3"));
  EXPECT_FALSE(session_->status().connected);
}

TEST_F(EdgeSessionTest, AttemptsAreFurtherAndFurtherApart) {
  link_.answers = false;
  std::vector<MonoNs> times;
  for (int i = 0; i < 600; ++i) {
    const int before = link_.connects;
    Step(100 * kMillisecond);
    if (link_.connects == before) continue;
    times.push_back(now_);
    Happens({.kind = Kind::kDown, .text = "refused"});
  }
  ASSERT_GE(times.size(), 5U);
  EXPECT_LE(times[1] - times[0], 600 * kMillisecond);
  EXPECT_GE(times.back() - times[times.size() - 2], 7 * kSecond);
}

class PrimaryHostSessionTest : public EdgeSessionTest {
 protected:
  PrimaryHostSessionTest() : EdgeSessionTest("scada1") {}
};

TEST_F(PrimaryHostSessionTest, WaitsForTheHostAndKeepsDataMeanwhile) {
  Step();
  EXPECT_THAT(link_.subscriptions, ElementsAre("spBv1.0/plant/NCMD/press3", "spBv1.0/STATE/scada1"));
  Position(0);
  Run(60);
  EXPECT_THAT(Kinds(), IsEmpty());
  EXPECT_TRUE(session_->waits_for_host());
  HostIs(false, 200);
  HostIs(true, 100);
  HostIs(true, 300, "scada2");
  EXPECT_THAT(Kinds(), IsEmpty()) << "older than the last one, and another host";
  HostIs(true, 200);
  EXPECT_EQ(Kinds()[0], "NBIRTH");
  EXPECT_THAT(Sent(true), ElementsAre(0U));
}

TEST_F(PrimaryHostSessionTest, AnOfflineHostEndsTheSessionWithNdeath) {
  Step();
  HostIs(true, 100);
  link_.sent.clear();
  HostIs(false, 99);
  EXPECT_TRUE(session_->born()) << "a delayed will of an earlier session";
  HostIs(false, 100);
  EXPECT_THAT(Kinds(), ElementsAre("NDEATH"));
  EXPECT_EQ(link_.disconnects, 1);
  Position(5);
  Run(2);
  EXPECT_EQ(link_.connects, 2);
  EXPECT_EQ(Read(link_.wills[1]).metrics[0].number, 1U);
  EXPECT_TRUE(session_->waits_for_host());
  HostIs(true, 300);
  EXPECT_THAT(Sent(true), ElementsAre(0U));
  EXPECT_EQ(link_.sent[1].Find("bdSeq")->number, 1U);
}

TEST_F(PrimaryHostSessionTest, AStateThatIsNoneIsIgnoredAndCounted) {
  Step();
  Happens({.kind = Kind::kReceived, .text = "ONLINE", .topic = "spBv1.0/STATE/scada1"});
  EXPECT_TRUE(session_->waits_for_host());
  EXPECT_EQ(session_->counts().ignored, 1);
}

}  // namespace
}  // namespace axlecast

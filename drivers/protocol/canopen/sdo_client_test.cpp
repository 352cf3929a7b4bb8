#include "drivers/protocol/canopen/sdo_client.h"

#include <gmock/gmock.h>

#include "core/device/operation.h"
#include "drivers/protocol/canopen/canopen.h"
#include "tests/support/golden_file.h"

namespace axlecast::canopen {
namespace {

constexpr std::uint8_t kNode = 2;
constexpr MonoNs kTimeout = 50 * kMillisecond;

class Cia406SdoClient : public testing::Test {
 protected:
  std::optional<SdoResult> Pass(Event::Kind kind, std::uint32_t id, Bytes bytes, MonoNs at) {
    const SdoClient::Evaluation evaluation = client_.On(
        {.kind = kind, .sent = {}, .received = {at, at}, .request = {}, .bytes = bytes, .secret = false, .id = id});
    unexpected_answer_ = evaluation.unexpected_answer;
    return evaluation.result;
  }
  void Ask(const SdoRequest& request, MonoNs at) {
    const CanFrame frame = RequestFrame(kNode, request);
    EXPECT_FALSE(Pass(Event::Kind::kSent, frame.id, frame.data, at));
  }
  std::optional<SdoResult> Answer(const std::string& bytes, MonoNs at) {
    return Pass(Event::Kind::kFrame, 0x582, GoldenBytes(bytes), at);
  }
  std::optional<SdoResult> Wait(MonoNs at) { return Pass(Event::Kind::kSilent, 0, {}, at); }
  [[nodiscard]] std::string Abort() const { return client_.abort() ? HexText(client_.abort()->data) : "none"; }
  void SendAbort(MonoNs at) {
    const CanFrame frame = *client_.abort();
    EXPECT_FALSE(Pass(Event::Kind::kSent, frame.id, frame.data, at));
  }

  SdoClient client_{kNode, kTimeout, 10 * kTimeout};
  bool unexpected_answer_ = false;
};

// python-canopen, test/test_sdo.py, test_expedited_upload and test_expedited_download.
TEST_F(Cia406SdoClient, ReadsAndWrites) {
  EXPECT_TRUE(client_.free());
  Ask({.object = kVendor, .write = {}}, 100);
  EXPECT_FALSE(client_.free());
  const auto read = Answer("43 18 10 01 04 00 00 00", 300);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->kind, SdoResult::Kind::kValue);
  EXPECT_EQ(read->value, 4U);
  EXPECT_EQ(read->sent.first, 100);
  EXPECT_EQ(read->received.last, 300);
  EXPECT_TRUE(client_.free());
  Ask({.object = kPreset, .write = 7}, 400);
  const auto written = Answer("60 03 60 00 00 00 00 00", 500);
  ASSERT_TRUE(written);
  EXPECT_EQ(written->kind, SdoResult::Kind::kWritten);
  EXPECT_EQ(written->request.write, 7U);
}

TEST_F(Cia406SdoClient, AnAbortOfTheServerEndsTheTransferWithItsCode) {
  Ask({.object = kWarnings, .write = {}}, 0);
  const auto result = Answer("80 05 65 00 00 00 02 06", 10);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->kind, SdoResult::Kind::kAborted);
  EXPECT_EQ(result->value, 0x0602'0000U);
  EXPECT_TRUE(client_.free()) << "an abort is not answered";
  Ask({.object = kWarnings, .write = {}}, 20);
  EXPECT_TRUE(Answer("80 00 00 00 00 00 00 08", 30)) << "some servers do not name the object";
}

TEST_F(Cia406SdoClient, AnAnswerThatIsNoneOfTheProtocolIsForeign) {
  Ask({.object = kVendor, .write = {}}, 0);
  EXPECT_FALSE(Answer("ff 18 10 01 04 00 00 00", 10));
  EXPECT_TRUE(unexpected_answer_);
  EXPECT_FALSE(client_.free()) << "its own may still come";
}

TEST_F(Cia406SdoClient, WithoutATransferNothingIsDue) {
  EXPECT_EQ(client_.due(), kNever);
  Ask({.object = kVendor, .write = {}}, 100);
  EXPECT_EQ(client_.due(), 100 + kTimeout);
}

TEST_F(Cia406SdoClient, AnAbortThatWasNotSentIsDropped) {
  Ask({.object = kVendor, .write = {}}, 0);
  ASSERT_TRUE(Wait(kTimeout));
  const CanFrame frame = *client_.abort();
  EXPECT_FALSE(Pass(Event::Kind::kNotSent, frame.id + 1, frame.data, kTimeout));
  EXPECT_NE(Abort(), "none") << "a frame to another node";
  EXPECT_FALSE(Pass(Event::Kind::kNotSent, frame.id, frame.data, kTimeout));
  EXPECT_EQ(Abort(), "none");
}

TEST_F(Cia406SdoClient, IfEveryFenceMayStillBeAnsweredTheFirstOneIsReadAgain) {
  MonoNs now = 0;
  std::vector<ObjectId> fences;
  ObjectId object = kVendor;
  for (int i = 0; i < 8; ++i) {
    Ask({.object = object, .write = {}}, now);
    ASSERT_TRUE(Wait(now += kTimeout));
    SendAbort(now);
    ASSERT_TRUE(client_.fence());
    object = *client_.fence();
    fences.push_back(object);
  }
  EXPECT_NE(fences[0], fences[1]);
  EXPECT_EQ(fences.back(), fences.front());
}

TEST_F(Cia406SdoClient, AnAnswerOfAnotherObjectOrKindIsForeign) {
  EXPECT_FALSE(Answer("43 18 10 01 04 00 00 00", 0));
  EXPECT_TRUE(unexpected_answer_) << "nothing was requested";
  Ask({.object = kVendor, .write = {}}, 0);
  for (const char* bytes : {"43 18 10 02 04 00 00 00", "43 17 10 01 04 00 00 00", "60 18 10 01 00 00 00 00",
                            "80 18 10 02 00 00 02 06", "00 54 69 6E 79 20 4E 6F", "43 18 10"}) {
    EXPECT_FALSE(Answer(bytes, 1)) << bytes;
    EXPECT_TRUE(unexpected_answer_) << bytes;
  }
  EXPECT_TRUE(Answer("43 18 10 01 04 00 00 00", 2)) << "it still waits for its own";
  EXPECT_FALSE(unexpected_answer_);
}

// python-canopen, test_segmented_upload: 26 bytes would follow.
TEST_F(Cia406SdoClient, ASegmentedAnswerIsEndedWithItsCode) {
  Ask({.object = {0x1008, 0}, .write = {}}, 0);
  const auto result = Answer("41 08 10 00 1A 00 00 00", 10);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->kind, SdoResult::Kind::kSegmented);
  EXPECT_EQ(result->value, 26U);
  EXPECT_FALSE(client_.free());
  EXPECT_EQ(Abort(), "80 08 10 00 10 00 07 06") << "0607 0010h: the length does not match";
  SendAbort(20);
  EXPECT_TRUE(client_.free());
}

TEST_F(Cia406SdoClient, ATimeOutIsEndedWithItsCodeAndFenced) {
  Ask({.object = kPosition, .write = {}}, 0);
  EXPECT_EQ(client_.due(), kTimeout);
  EXPECT_FALSE(Wait(kTimeout - 1));
  const auto result = Wait(kTimeout);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->kind, SdoResult::Kind::kTimedOut);
  EXPECT_EQ(Abort(), "80 04 60 00 00 00 04 05") << "0504 0000h: SDO protocol timed out";
  SendAbort(kTimeout + 1);
  EXPECT_EQ(client_.fence(), kDeviceType);
  Ask({.object = kDeviceType, .write = {}}, kTimeout + 2);
  EXPECT_FALSE(Answer("43 04 60 00 01 00 00 00", kTimeout + 3)) << "the late one";
  EXPECT_TRUE(unexpected_answer_);
  EXPECT_TRUE(Answer("43 00 10 00 96 01 02 00", kTimeout + 4));
  EXPECT_FALSE(client_.fence()) << "what was late would have come before";
}

TEST_F(Cia406SdoClient, AFenceThatIsNotAnsweredIsFencedByAnotherObject) {
  Ask({.object = kDeviceType, .write = {}}, 0);
  EXPECT_TRUE(Wait(kTimeout));
  EXPECT_EQ(client_.fence(), kVendor);
  EXPECT_EQ(client_.silent_in_a_row(), 1);
}

// README.md, "What it does": an answer may come twelve time-outs late, and names no request.
TEST_F(Cia406SdoClient, ALateAnswerIsNotThatToAnotherRequestForItsObject) {
  MonoNs now = 0;
  for (const ObjectId object : {kDeviceType, kVendor}) {
    Ask({.object = object, .write = {}}, now);
    now += kTimeout;
    EXPECT_TRUE(Wait(now));
  }
  EXPECT_EQ(client_.fence(), kProduct) << "of both others an answer may still come";
  Ask({.object = kDeviceType, .write = {}}, now);
  EXPECT_FALSE(Answer("43 00 10 00 96 01 02 00", now + 1)) << "to the first request";
  EXPECT_TRUE(unexpected_answer_);
  EXPECT_TRUE(Answer("43 00 10 00 96 01 02 00", now + 2));
}

TEST_F(Cia406SdoClient, AfterTheLateBoundAnAnswerIsThatToTheNewRequest) {
  Ask({.object = kDeviceType, .write = {}}, 0);
  EXPECT_TRUE(Wait(kTimeout));
  const MonoNs later = 10 * kTimeout + 1;
  Ask({.object = kDeviceType, .write = {}}, later);
  EXPECT_TRUE(Answer("43 00 10 00 96 01 02 00", later + 1));
}

TEST_F(Cia406SdoClient, ASaveHasMoreTime) {
  Ask({.object = kStoreAll, .write = kSaveSignature}, 0);
  EXPECT_FALSE(Wait(4 * kSecond));
  EXPECT_TRUE(Wait(5 * kSecond));
  client_.Reset();
  Ask({.object = kStoreAll, .write = {}}, 0);
  EXPECT_EQ(client_.due(), kTimeout) << "reading it has not";
}

TEST_F(Cia406SdoClient, OtherNodesAreNothingToIt) {
  Ask({.object = kVendor, .write = {}}, 0);
  EXPECT_FALSE(Pass(Event::Kind::kFrame, 0x583, GoldenBytes("43 18 10 01 04 00 00 00"), 1));
  EXPECT_FALSE(unexpected_answer_);
  EXPECT_FALSE(Pass(Event::Kind::kSent, 0x603, GoldenBytes("40 00 10 00 00 00 00 00"), 2));
  EXPECT_TRUE(Answer("43 18 10 01 04 00 00 00", 3));
}

}  // namespace
}  // namespace axlecast::canopen

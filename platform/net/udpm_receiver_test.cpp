#include "platform/net/udpm_receiver.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "platform/net/datagram_test_support.h"

namespace axlecast {
namespace {

std::vector<std::uint8_t> FromHex(std::string_view hex) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < hex.size(); i += 2) {
    bytes.push_back(static_cast<std::uint8_t>(std::stoul(std::string(hex.substr(i, 2)), nullptr, 16)));
  }
  return bytes;
}

std::string Text(Bytes bytes) { return {bytes.begin(), bytes.end()}; }

bool IsRefused(const FragmentFields& fields, std::string_view payload) {
  return !ParseUdpm(FragmentDatagram(fields, "BIG", payload));
}

// Sent by stock liblcm 1.3.1 (Debian 12): lcm_publish(lcm, "POSITION/axis1", {1, 2, 3, 4, 5}, 5), its first message.
TEST(UdpmPacketTest, ReadsAShortMessageOfStockLcm) {
  const auto datagram = FromHex("4c43303200000000504f534954494f4e2f6178697331000102030405");
  const auto packet = ParseUdpm(datagram);
  ASSERT_TRUE(packet);
  const auto& message = std::get<ShortPacket>(*packet);
  EXPECT_EQ(message.sequence, 0U);
  EXPECT_EQ(message.channel, "POSITION/axis1");
  EXPECT_EQ(Text(message.payload), "\x01\x02\x03\x04\x05");
}

// The second: lcm_publish(lcm, "EMPTY", "", 0).
TEST(UdpmPacketTest, ReadsAnEmptyMessageOfStockLcm) {
  const auto datagram = FromHex("4c43303200000001454d50545900");
  const auto packet = ParseUdpm(datagram);
  ASSERT_TRUE(packet);
  EXPECT_EQ(std::get<ShortPacket>(*packet).sequence, 1U);
  EXPECT_EQ(std::get<ShortPacket>(*packet).channel, "EMPTY");
  EXPECT_TRUE(std::get<ShortPacket>(*packet).payload.empty());
}

// The third: 150,000 bytes on "BIG". Its fragments 0 and 2, the headers as captured, of 65,507 and 19,050 bytes.
TEST(UdpmPacketTest, ReadsFragmentsOfStockLcm) {
  auto first = FromHex("4c43303300000002000249f0000000000000000342494700");
  first.resize(65'507, 7);
  const auto packet = ParseUdpm(first);
  ASSERT_TRUE(packet);
  const auto& fragment = std::get<FragmentPacket>(*packet);
  EXPECT_EQ(fragment.sequence, 2U);
  EXPECT_EQ(fragment.size, 150'000U);
  EXPECT_EQ(fragment.offset, 0U);
  EXPECT_EQ(fragment.number, 0);
  EXPECT_EQ(fragment.count, 3);
  EXPECT_EQ(fragment.channel, "BIG");
  EXPECT_EQ(fragment.payload.size(), 65'483U);

  auto last = FromHex("4c43303300000002000249f00001ff9a00020003");
  last.resize(19'050, 7);
  const auto end = ParseUdpm(last);
  ASSERT_TRUE(end);
  EXPECT_EQ(std::get<FragmentPacket>(*end).offset, 130'970U);
  EXPECT_EQ(std::get<FragmentPacket>(*end).offset + std::get<FragmentPacket>(*end).payload.size(), 150'000U);
  EXPECT_TRUE(std::get<FragmentPacket>(*end).channel.empty());
}

TEST(UdpmPacketTest, TakesChannelsOfUpTo63Characters) {
  EXPECT_TRUE(ParseUdpm(ShortDatagram(1, std::string(63, 'c'), "x")));
  EXPECT_FALSE(ParseUdpm(ShortDatagram(1, std::string(64, 'c'), "x")));
  EXPECT_FALSE(ParseUdpm(ShortDatagram(1, "", "x")));
}

TEST(UdpmPacketTest, RefusesWhatIsNotLcm) {
  EXPECT_FALSE(ParseUdpm({}));
  EXPECT_FALSE(ParseUdpm(DatagramText().U32(0x4c433031).U32(1).Channel("A").bytes));
  EXPECT_FALSE(ParseUdpm(DatagramText().U32(0x4c433032).Text("abc").bytes));
  EXPECT_FALSE(ParseUdpm(DatagramText().U32(0x4c433032).U32(1).Text("NO_END").bytes));
}

TEST(UdpmPacketTest, RefusesEveryCutFragmentHeader) {
  const auto whole = FragmentDatagram({.sequence = 1, .size = 9, .number = 0, .count = 2}, "BIG", "");
  EXPECT_TRUE(ParseUdpm(whole));
  for (std::size_t size = 0; size < whole.size(); ++size) EXPECT_FALSE(ParseUdpm(Bytes(whole).first(size))) << size;
}

TEST(UdpmPacketTest, RefusesFragmentsThatContradictThemselves) {
  EXPECT_FALSE(IsRefused({.size = 9, .offset = 4, .number = 1, .count = 2}, "12345"));
  EXPECT_TRUE(IsRefused({.size = 9, .offset = 5, .number = 1, .count = 2}, "12345")) << "beyond the message";
  EXPECT_TRUE(IsRefused({.size = 9, .offset = 0xfffffffe, .number = 1, .count = 2}, "12345")) << "wraps around";
  EXPECT_TRUE(IsRefused({.size = 9, .offset = 4, .number = 2, .count = 2}, "12345")) << "no such fragment";
  EXPECT_TRUE(IsRefused({.size = 9, .number = 0, .count = 0}, "")) << "of none";
  EXPECT_TRUE(IsRefused({.size = 9, .offset = 4, .number = 1, .count = 2}, "")) << "brings nothing";
  EXPECT_TRUE(IsRefused({.size = 9, .offset = 1, .number = 0, .count = 2}, "1"))
      << "the first is not the beginning";
  EXPECT_TRUE(IsRefused({.size = 9, .number = 0, .count = 1}, "12345")) << "the only one is not all";
  EXPECT_TRUE(IsRefused({.size = 9, .number = 0, .count = 2}, "123456789")) << "nothing is left for the other";
  EXPECT_TRUE(IsRefused({.size = 9, .offset = 4, .number = 1, .count = 11}, "1")) << "more fragments than bytes";
  EXPECT_TRUE(IsRefused({.size = (1U << 28) + 1, .number = 0, .count = 2}, "1")) << "larger than LCM sends";
}

TEST(UdpmPacketTest, TakesFragmentsAtEveryLimit) {
  EXPECT_FALSE(IsRefused({.size = 0, .number = 0, .count = 1}, "")) << "an empty message";
  EXPECT_FALSE(IsRefused({.size = 9, .offset = 4, .number = 1, .count = 10}, "1"))
      << "a byte for each after the first";
  EXPECT_FALSE(IsRefused({.size = 1U << 28, .number = 0, .count = 2}, "1")) << "the largest that LCM sends";
}

using ::testing::ElementsAre;

constexpr SenderAddress kOne = SenderAddress::OfIPv4(0x7f000001, 40'001);
constexpr SenderAddress kOther = SenderAddress::OfIPv4(0x7f000001, 40'002);

class UdpmReceiverTest : public ::testing::Test {
 protected:
  void On(const std::vector<std::uint8_t>& bytes, const SenderAddress& sender = kOne) {
    ++utime_;
    receiver_.On({sender, utime_, now_, bytes}, [this](const ReceivedMessage& message) {
      messages_.push_back(std::string(message.channel) + '=' +
                          std::string(message.data.begin(), message.data.end()));
      utime_of_newest_ = message.utime;
    });
  }
  void Short(std::uint32_t sequence, const SenderAddress& sender = kOne) {
    On(ShortDatagram(sequence, "C", std::to_string(sequence)), sender);
  }
  // A fragment of "abcdefghij", 4 bytes each but the last.
  void Part(std::uint32_t sequence, std::uint32_t number, const SenderAddress& sender = kOne) {
    On(FragmentDatagram({sequence, 10, number * 4, number, 3}, "BIG",
                        std::string_view("abcdefghij").substr(number * 4, 4)),
       sender);
  }

  UdpmReceiver receiver_;
  std::vector<std::string> messages_;
  std::int64_t utime_ = 1'000'000'000;
  std::int64_t utime_of_newest_ = 0;
  MonoNs now_ = 0;
};

TEST_F(UdpmReceiverTest, CountsEachSenderByItself) {
  Short(0);
  Short(100, kOther);
  Short(3);
  Short(102, kOther);
  EXPECT_THAT(messages_, ElementsAre("C=0", "C=100", "C=3", "C=102"));
  const auto senders = receiver_.senders();
  ASSERT_EQ(senders.size(), 2U);
  EXPECT_EQ(senders[0].sender, kOne);
  EXPECT_EQ(senders[0].lost, 2);
  EXPECT_EQ(senders[1].lost, 1);
  EXPECT_EQ(senders[1].received, 2);
  EXPECT_EQ(receiver_.lost(), 3);
  EXPECT_EQ(receiver_.received(), 4);
}

TEST_F(UdpmReceiverTest, HandsRepeatedMessagesOnAndCountsThem) {
  Short(0);
  Short(0);
  EXPECT_EQ(messages_.size(), 2U);
  EXPECT_EQ(receiver_.senders()[0].repeated, 1);
  EXPECT_EQ(receiver_.lost(), 0);
}

TEST_F(UdpmReceiverTest, JoinsFragmentsInAnyOrder) {
  const std::vector<std::vector<std::uint32_t>> orders = {{0, 1, 2}, {2, 1, 0}, {1, 0, 2}, {2, 0, 1}};
  for (std::uint32_t i = 0; i < orders.size(); ++i) {
    for (const std::uint32_t part : orders[i]) Part(i, part);
    EXPECT_EQ(messages_.size(), i + 1);
    EXPECT_EQ(messages_.back(), "BIG=abcdefghij");
    EXPECT_EQ(utime_of_newest_, utime_);
  }
  EXPECT_EQ(receiver_.lost(), 0);
}

TEST_F(UdpmReceiverTest, JoinsFragmentsOfSeveralSendersAndMessagesAtOnce) {
  for (const std::uint32_t part : {0U, 1U, 2U}) {
    Part(7, part);
    Part(8, part);
    Part(7, part, kOther);
    Part(7, part);  // a copy of it
  }
  EXPECT_THAT(messages_, ElementsAre("BIG=abcdefghij", "BIG=abcdefghij", "BIG=abcdefghij"));
  EXPECT_EQ(receiver_.lost(), 0);
}

TEST_F(UdpmReceiverTest, AFragmentThatIsMissingIsAMessageLost) {
  Short(0);
  Part(1, 0);
  Part(1, 2);
  EXPECT_EQ(receiver_.lost(), 0) << "it may come";
  now_ += FragmentStore::kAge + 1;
  Part(2, 0);
  EXPECT_EQ(receiver_.lost(), 1);
  EXPECT_EQ(receiver_.senders()[0].lost, 1);
  receiver_.End();
  EXPECT_EQ(receiver_.lost(), 2) << "also the last, although no later one follows";
}

TEST_F(UdpmReceiverTest, FragmentsThatContradictEachOtherMakeNoMessage) {
  Part(1, 0);
  On(FragmentDatagram({1, 11, 4, 1, 3}, "", "efgh"));  // of another size
  Part(1, 1);
  Part(1, 2);
  EXPECT_TRUE(messages_.empty());
  On(FragmentDatagram({2, 10, 0, 0, 2}, "BIG", "abcdef"));
  On(FragmentDatagram({2, 10, 5, 1, 2}, "", "fghij"));  // overlaps
  On(FragmentDatagram({3, 10, 0, 0, 2}, "BIG", "abcd"));
  On(FragmentDatagram({3, 10, 5, 1, 2}, "", "fghij"));  // a gap
  On(FragmentDatagram({4, 10, 0, 0, 2}, "BIG", "abcde"));
  On(FragmentDatagram({4, 10, 5, 1, 2}, "", "fghi"));  // too short
  EXPECT_TRUE(messages_.empty());
  receiver_.End();
  EXPECT_EQ(receiver_.lost(), 4);
}

TEST_F(UdpmReceiverTest, AFragmentThatContradictsAnEarlierOneBeginsTheMessageAgain) {
  Part(1, 0);
  On(FragmentDatagram({1, 10, 0, 0, 3}, "BIG", "wxyz"));
  Part(1, 1);
  Part(1, 2);
  EXPECT_THAT(messages_, ElementsAre("BIG=wxyzefghij"));
}

TEST_F(UdpmReceiverTest, FragmentsOfOneMessageMayComeTwoSecondsApart) {
  now_ = 5 * kSecond;
  Part(1, 0);
  now_ += FragmentStore::kAge;
  Part(1, 1);
  Part(1, 2);
  EXPECT_THAT(messages_, ElementsAre("BIG=abcdefghij"));
}

TEST_F(UdpmReceiverTest, AWholeMessageLeavesNothingThatExpires) {
  for (const std::uint32_t sequence : {1U, 2U}) {
    for (const std::uint32_t part : {0U, 1U, 2U}) Part(sequence, part);
    EXPECT_EQ(receiver_.fragment_memory(), 0U);
    now_ += FragmentStore::kAge + 1;
  }
  EXPECT_EQ(messages_.size(), 2U);
}

TEST_F(UdpmReceiverTest, AShortMessageReplacesFragmentsOfItsNumber) {
  Part(5, 0);
  Part(6, 0);
  Short(5);
  Part(5, 1);
  Part(5, 2);
  EXPECT_THAT(messages_, ElementsAre("C=5"));
  Part(6, 1);
  Part(6, 2);
  EXPECT_THAT(messages_, ElementsAre("C=5", "BIG=abcdefghij"));
}

TEST_F(UdpmReceiverTest, AfterItsEndItReceivesAsBefore) {
  Part(1, 0);
  Part(2, 0);
  receiver_.End();
  EXPECT_EQ(receiver_.fragment_memory(), 0U);
  for (const std::uint32_t part : {0U, 1U, 2U}) Part(3, part);
  EXPECT_THAT(messages_, ElementsAre("BIG=abcdefghij"));
}

TEST_F(UdpmReceiverTest, SendersWithEqualLossesAreInTheOrderOfTheirAddresses) {
  for (const SenderAddress& sender : {kOther, kOne}) Short(7, sender);
  ASSERT_EQ(receiver_.senders().size(), 2U);
  EXPECT_EQ(receiver_.senders()[0].sender, kOne);
}

TEST_F(UdpmReceiverTest, TheIncompleteMessagesOfEachSenderAreItsOwn) {
  Part(1, 0);
  Part(1, 0, kOther);
  Part(2, 0, kOther);
  now_ += FragmentStore::kAge + 1;
  Part(3, 0, kOther);
  const auto senders = receiver_.senders();
  EXPECT_EQ(senders[0].sender, kOther);
  EXPECT_EQ(senders[0].lost, 2);
  EXPECT_EQ(senders[1].lost, 1);
}

TEST_F(UdpmReceiverTest, CopiesOfFragmentsChangeNothing) {
  Part(1, 0);
  Part(1, 0);
  Part(1, 1);
  Part(1, 1);
  Part(1, 2);
  Part(1, 2);
  EXPECT_EQ(messages_.size(), 1U);
  receiver_.End();
  EXPECT_EQ(receiver_.lost(), 0);
}

TEST_F(UdpmReceiverTest, CountsWhatIsNotLcm) {
  On({1, 2, 3});
  EXPECT_EQ(receiver_.malformed(), 1);
  EXPECT_TRUE(receiver_.senders().empty());
}

TEST_F(UdpmReceiverTest, ForgetsTheSenderThatIsSilentForLongestButNotItsLosses) {
  Short(0);
  Short(9);
  for (std::uint16_t i = 0; i < UdpmReceiver::kMaxSenders; ++i) {
    ++now_;
    Short(0, SenderAddress::OfIPv4(0x0a000001, i));
  }
  EXPECT_EQ(receiver_.senders().size(), UdpmReceiver::kMaxSenders);
  EXPECT_EQ(receiver_.senders()[0].lost, 0);
  EXPECT_EQ(receiver_.lost(), 8);
}

TEST_F(UdpmReceiverTest, TheFragmentsOfARemovedSenderAreRemovedAndNoOthers) {
  Part(1, 0);
  Part(2, 0);
  const std::size_t two = receiver_.fragment_memory();
  Part(1, 0, kOther);
  Part(2, 0, kOther);
  const auto others = static_cast<std::uint16_t>(UdpmReceiver::kMaxSenders - 1);
  for (std::uint16_t i = 0; i < others; ++i) Short(0, SenderAddress::OfIPv4(0x0a000001, i));
  EXPECT_EQ(receiver_.fragment_memory(), two);
  Part(1, 1, kOther);
  Part(1, 2, kOther);
  EXPECT_EQ(messages_.back(), "BIG=abcdefghij");
}

TEST_F(UdpmReceiverTest, ASenderThatContinuesIsNotTheOneThatIsRemoved) {
  Short(0);
  Short(0, kOther);
  Short(3);  // kOther is silent for longest now
  const auto others = static_cast<std::uint16_t>(UdpmReceiver::kMaxSenders - 1);
  for (std::uint16_t i = 0; i < others; ++i) Short(0, SenderAddress::OfIPv4(0x0a000001, i));
  EXPECT_EQ(receiver_.senders()[0].sender, kOne);
  EXPECT_EQ(receiver_.senders()[0].lost, 2);
}

TEST_F(UdpmReceiverTest, ASenderIsEstablishedByItsSixteenthMessage) {
  for (std::uint32_t i = 0; i < 16; ++i) Short(i);
  for (std::uint32_t i = 0; i < 15; ++i) Short(i, kOther);
  for (std::uint16_t i = 0; i < UdpmReceiver::kMaxSenders; ++i) Short(0, SenderAddress::OfIPv4(0x0a000001, i));
  const auto senders = receiver_.senders();
  const auto is_there = [&senders](const SenderAddress& address) {
    return std::any_of(senders.begin(), senders.end(),
                       [&](const SenderCount& one) { return one.sender == address; });
  };
  EXPECT_TRUE(is_there(kOne));
  EXPECT_FALSE(is_there(kOther));
}

TEST_F(UdpmReceiverTest, AnEstablishedSenderStaysSoWhileItsMessageIsIncomplete) {
  for (std::uint32_t i = 0; i < 17; ++i) Short(i);
  Part(17, 0);
  for (std::uint16_t i = 0; i < UdpmReceiver::kMaxSenders; ++i) Short(0, SenderAddress::OfIPv4(0x0a000001, i));
  Part(17, 1);
  Part(17, 2);
  EXPECT_EQ(messages_.back(), "BIG=abcdefghij");
}

// A flood from ever new addresses made every counter of the machine's own senders begin again.
TEST_F(UdpmReceiverTest, ManyNewSendersDisplaceNoneThatIsEstablished) {
  for (std::uint32_t i = 0; i < 20; ++i) Short(i);
  for (std::uint32_t i = 0; i < 50'000; ++i)
    Short(0, SenderAddress::OfIPv4(0x0a000000 + i / 60'000, static_cast<std::uint16_t>(i)));
  EXPECT_EQ(receiver_.senders().size(), UdpmReceiver::kMaxSenders);
  Short(22);
  EXPECT_EQ(receiver_.senders()[0].sender, kOne);
  EXPECT_EQ(receiver_.senders()[0].lost, 2);
  EXPECT_EQ(receiver_.senders()[0].received, 21);
}

TEST_F(UdpmReceiverTest, EstablishedSendersAreBoundedToo) {
  for (std::uint32_t i = 0; i < 3'000; ++i) {
    for (std::uint32_t number = 0; number < 20; ++number)
      Short(number, SenderAddress::OfIPv4(0x0a000000, static_cast<std::uint16_t>(i)));
  }
  EXPECT_EQ(receiver_.senders().size(), UdpmReceiver::kMaxSenders);
}

FragmentPacket PartOf(std::uint32_t sequence, std::uint32_t part, Bytes bytes) {
  return {sequence, 1U << 20, part * 1'000, static_cast<std::uint16_t>(part), 1'000, part == 0 ? "C" : "", bytes};
}

// Incomplete messages took 64 MB, from any sender.
TEST(FragmentStoreTest, ASenderHasOneLongMessageAndFewOlderOnes) {
  FragmentStore store(FragmentLimits{.total = 2U << 20, .older = 64U << 10});
  const std::vector<std::uint8_t> bytes(1'000, 1);
  for (std::uint32_t sequence = 0; sequence < 5'000; ++sequence) {
    for (std::uint32_t part = 0; part < 3; ++part) {
      static_cast<void>(store.Add(kOne, PartOf(sequence, part, bytes), 0, false));
    }
    ASSERT_LE(store.memory(), 72U << 10);
  }
}

TEST(FragmentStoreTest, AMessageThatIsLateDoesNotTakeTheNewestsPlace) {
  FragmentStore store(FragmentLimits{.total = 2U << 20, .older = 4U << 10});
  const std::vector<std::uint8_t> bytes(1'000, 1);
  for (std::uint32_t part = 0; part < 100; ++part)
    static_cast<void>(store.Add(kOne, PartOf(7, part, bytes), 0, true));
  static_cast<void>(store.Add(kOne, PartOf(6, 5, bytes), 0, false));
  EXPECT_GT(store.memory(), 100'000U);
  EXPECT_EQ(store.awaited(), 1);
}

TEST(FragmentStoreTest, TheLargestGivesWayFirst) {
  FragmentStore store(FragmentLimits{.total = 100'000, .older = 4U << 10});
  const std::vector<std::uint8_t> bytes(1'000, 1);
  FragmentPacket small{1, 2'000, 0, 0, 2, "C", bytes};
  static_cast<void>(store.Add(kOther, small, 0, true));
  for (std::uint32_t part = 0; part < 200; ++part) {
    FragmentPacket packet = PartOf(7, part, bytes);
    packet.size = 100'000;
    static_cast<void>(store.Add(kOne, packet, 0, false));
    ASSERT_LE(store.memory(), 100'000U);
  }
  const FragmentPacket rest{1, 2'000, 1'000, 1, 2, "", bytes};
  EXPECT_TRUE(store.Add(kOther, rest, 0, true));
}

TEST(FragmentStoreTest, HoldsNoMoreThanItsMemoryAndGivesUpTheOldest) {
  FragmentStore store;
  const std::vector<std::uint8_t> bytes(60'000, 1);
  const auto packet = [&](std::uint32_t sequence, std::uint16_t number) {
    FragmentPacket fragment{sequence, 120'000, number * 60'000U, number, 2, number == 0 ? "C" : "", bytes};
    return fragment;
  };
  for (std::uint32_t sequence = 0; sequence < 3'000; ++sequence) {
    EXPECT_FALSE(store.Add(kOne, packet(sequence, 0), 0, true));
    ASSERT_LE(store.memory(), FragmentLimits{}.total);
  }
  EXPECT_LT(store.awaited(kOne), 1'200);
  EXPECT_FALSE(store.Add(kOne, packet(0, 1), 0, true)) << "its beginning was given up";
  EXPECT_TRUE(store.Add(kOne, packet(2'999, 1), 0, true));
}

TEST(FragmentStoreTest, TinyHostileFragmentsAreBoundedToo) {
  FragmentStore store;
  const std::uint8_t byte = 1;
  for (std::uint32_t sequence = 0; sequence < 200'000; ++sequence) {
    static_cast<void>(store.Add(kOne, {sequence, 1U << 26, 0, 0, 0xffff, "C", {&byte, 1}}, 0, true));
  }
  EXPECT_LE(store.memory(), FragmentLimits{}.total);
  EXPECT_LT(store.awaited(), 140'000);
}

TEST(FragmentStoreTest, CountsWhatAnIncompleteMessageCostsBesideItsBytes) {
  FragmentStore store;
  const std::uint8_t byte = 1;
  for (std::uint32_t sequence = 0; sequence < 10'000; ++sequence) {
    static_cast<void>(store.Add(kOne, {sequence, 9, 0, 0, 9, "C", {&byte, 1}}, 0, true));
  }
  EXPECT_LT(store.awaited(), static_cast<std::int64_t>(FragmentLimits{}.older / 400)) << "about 500 bytes each";
}

TEST(FragmentStoreTest, TakesAMessageOfExactlyItsLimit) {
  FragmentStore store(FragmentLimits{.total = 2'000, .older = 1'000});
  const std::vector<std::uint8_t> bytes(500, 1);
  EXPECT_FALSE(store.Add(kOne, {1, 2'000, 0, 0, 2, "C", bytes}, 0, true));
  EXPECT_EQ(store.awaited(), 1);
}

TEST(FragmentStoreTest, HoldsIncompleteMessagesUpToItsLimits) {
  const std::vector<std::uint8_t> bytes(100, 1);
  FragmentStore one;
  static_cast<void>(one.Add(kOne, {1, 200, 0, 0, 2, "C", bytes}, 0, true));
  const auto held = [&bytes](const FragmentLimits& limits, const SenderAddress& second) {
    FragmentStore store(limits);
    static_cast<void>(store.Add(kOne, {1, 200, 0, 0, 2, "C", bytes}, 0, true));
    static_cast<void>(store.Add(second, {2, 200, 0, 0, 2, "C", bytes}, 0, true));
    return store.awaited();
  };
  EXPECT_EQ(held({.total = 1U << 20, .older = one.memory()}, kOne), 2);
  EXPECT_EQ(held({.total = 1U << 20, .older = one.memory() - 1}, kOne), 1);
  EXPECT_EQ(held({.total = 2 * one.memory(), .older = 0}, kOther), 2);
  EXPECT_EQ(held({.total = 2 * one.memory() - 1, .older = 0}, kOther), 1);
}

TEST(FragmentStoreTest, HoldsAfterItsClearingAsMuchAsBefore) {
  FragmentStore store(FragmentLimits{.total = 2U << 20, .older = 4U << 10});
  const std::vector<std::uint8_t> bytes(1'000, 1);
  for (const std::uint32_t round : {0U, 10U}) {
    for (std::uint32_t sequence = round; sequence < round + 3; ++sequence) {
      static_cast<void>(store.Add(kOne, PartOf(sequence, 0, bytes), 0, true));
    }
    EXPECT_EQ(store.awaited(), 3);
    store.Clear();
    EXPECT_EQ(store.memory(), 0U);
    EXPECT_EQ(store.awaited(), 0);
  }
}

TEST(FragmentStoreTest, WhatWasClearedNeitherExpiresNorMakesRoom) {
  FragmentStore store(FragmentLimits{.total = 2U << 20, .older = 4U << 10});
  const std::vector<std::uint8_t> bytes(1'000, 1);
  for (const std::uint32_t round : {0U, 1U}) {
    const MonoNs now = round == 0 ? 0 : kNever / 2;
    // Each message but the newest is an older one of its sender: the third of them is beyond the limit.
    for (std::uint32_t sequence = 0; sequence < 4; ++sequence)
      static_cast<void>(store.Add(kOne, PartOf(100 * round + sequence, 0, bytes), now, true));
    EXPECT_GT(store.awaited(), 1);
    EXPECT_LT(store.awaited(), 4);
    store.Clear();
  }
}

TEST(FragmentStoreTest, BeginsNoMessageThatItCouldNeverHold) {
  FragmentStore store;
  const std::uint8_t byte = 1;
  static_cast<void>(store.Add(kOne, {1, (1U << 26) + 1, 0, 0, 2, "C", {&byte, 1}}, 0, true));
  EXPECT_EQ(store.memory(), 0U);
}

}  // namespace

}  // namespace axlecast

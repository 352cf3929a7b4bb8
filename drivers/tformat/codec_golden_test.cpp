// The frames of golden/, read by the codec: other people's captures, and the maker's statements written out by
// hand.
#include <gtest/gtest.h>

#include <iomanip>
#include <sstream>

#include "drivers/tformat/codec.h"
#include "tests/support/golden_file.h"

namespace axlecast::tformat {
namespace {

std::string Hex(std::uint8_t byte) {
  std::ostringstream text;
  text << std::hex << std::uppercase << std::setw(2) << std::setfill('0') << int{byte};
  return text.str();
}

// All that the reply holds, as the golden files write it.
std::string Held(const Reply& reply) {
  std::ostringstream text;
  if (reply.error != ReplyError::kNone) text << " error=" << ReplyErrorName(reply.error);
  if (reply.status) text << " status=" << Hex(*reply.status);
  if (reply.single_turn) text << " single_turn=" << *reply.single_turn;
  if (reply.encoder_id) text << " encoder_id=" << Hex(*reply.encoder_id);
  if (reply.multi_turn) text << " multi_turn=" << *reply.multi_turn;
  if (reply.alarms) text << " alarms=" << Hex(*reply.alarms);
  if (reply.address) text << " address=" << int{*reply.address};
  if (reply.busy) text << " busy=" << int{*reply.busy};
  if (reply.data) text << " data=" << Hex(*reply.data);
  return text.str().substr(text.str().empty() ? 0 : 1);
}

void ExpectReplies(const std::string& file) {
  for (const GoldenRow& row : GoldenRows(__FILE__, file, 4)) {
    const std::vector<std::uint8_t> request = GoldenBytes(row.columns[0]);
    const std::vector<std::uint8_t> bytes = GoldenBytes(row.columns[1]);
    const Format format{.single_turn_bits = std::stoi(row.columns[2])};
    const Reply reply = ParseReply(request, bytes, format);
    EXPECT_EQ(Held(reply), row.columns[3]) << row.where;
    if (reply.error != ReplyError::kNone) continue;
    const Frame made = MakeReply(reply);
    EXPECT_EQ(std::vector<std::uint8_t>(made.data(), made.data() + made.size()), bytes) << row.where;
  }
}

TEST(CodecGolden, Captures) { ExpectReplies("captures.txt"); }

TEST(CodecGolden, SpecReplies) { ExpectReplies("spec_replies.txt"); }

Frame Make(const RequestFields& fields) {
  if (fields.data) return EepromWriteRequest(*fields.address, *fields.data);
  if (fields.address) return EepromReadRequest(*fields.address);
  return Request(fields.id);
}

TEST(CodecGolden, Requests) {
  for (const GoldenRow& row : GoldenRows(__FILE__, "requests.txt", 4)) {
    const std::vector<std::uint8_t> bytes = GoldenBytes(row.columns[0]);
    const std::optional<RequestFields> fields = ParseRequest(bytes);
    ASSERT_EQ(fields.has_value(), row.columns[1] != "-") << row.where;
    if (!fields) continue;
    EXPECT_EQ(static_cast<unsigned long>(fields->id), std::stoul(row.columns[1], nullptr, 16)) << row.where;
    EXPECT_EQ(fields->address ? std::to_string(*fields->address) : "-", row.columns[2]) << row.where;
    EXPECT_EQ(fields->data ? Hex(*fields->data) : "-", row.columns[3]) << row.where;
    const Frame made = Make(*fields);
    EXPECT_EQ(std::vector<std::uint8_t>(made.data(), made.data() + made.size()), bytes) << row.where;
  }
}

}  // namespace
}  // namespace axlecast::tformat

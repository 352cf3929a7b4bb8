#include "tools/foxglove/foxglove_feed.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/messages/json/field.h"

namespace axlecast {
namespace {

constexpr std::size_t kMaxProblems = 20;

}  // namespace

FoxgloveFeed::News FoxgloveFeed::On(const std::string& name, Bytes message) {
  News news;
  const std::optional<std::int64_t> fingerprint = Fingerprint(message);
  if (!fingerprint) return news;
  const auto found = channels_.find(name);
  if (found != channels_.end() && found->second.fingerprint == *fingerprint) {
    if (found->second.channel.id == 0) return news;
    news.channel = &found->second.channel;
    news.schema = found->second.schema;
    return news;
  }
  if (found == channels_.end() && channels_.size() >= kMaxChannels) {
    Report("more than 4096 channels: the others are not shown", news);
    return news;
  }
  Channel& channel = channels_[name];
  news.unadvertise = channel.channel.id;
  channel = {.fingerprint = *fingerprint, .channel = {}, .schema = SchemaOf(*fingerprint)};
  if (channel.schema == nullptr) {
    Report("the type of the messages of " + Quoted(MendedUtf8(name)) +
               " is not known: give its .lcm file with --types",
           news);
    return news;
  }
  channel.channel = {.id = ++last_id_,
                     .topic = '/' + MendedUtf8(name),
                     .schema_name = channel.schema->name(),
                     .schema = channel.schema->text()};
  news.channel = &channel.channel;
  news.schema = channel.schema;
  news.advertise = true;
  return news;
}

const RosSchema* FoxgloveFeed::SchemaOf(std::int64_t fingerprint) {
  const LcmStruct* const type = definitions_.Find(fingerprint);
  if (type == nullptr) return nullptr;
  std::unique_ptr<RosSchema>& schema = schemas_[fingerprint];
  if (schema == nullptr) schema = std::make_unique<RosSchema>(definitions_, *type);
  return schema.get();
}

// A problem that is not new is no news.
void FoxgloveFeed::Report(const std::string& problem, News& news) {
  if (problems_.size() >= kMaxProblems || std::ranges::find(problems_, problem) != problems_.end()) return;
  problems_.push_back(problem);
  news.problem = problem;
}

std::vector<const FoxgloveChannel*> FoxgloveFeed::Channels() const {
  std::vector<const FoxgloveChannel*> list;
  for (const auto& [name, channel] : channels_) {
    if (channel.channel.id != 0) list.push_back(&channel.channel);
  }
  return list;
}

bool FoxgloveFeed::Knows(std::uint32_t channel) const {
  return channel != 0 &&
         std::ranges::any_of(channels_, [channel](const auto& each) { return each.second.channel.id == channel; });
}

}  // namespace axlecast

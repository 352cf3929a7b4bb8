#include "tools/log/channel_filter.h"

#include <utility>

#include "core/base/expression.h"
#include "core/base/result.h"

namespace axlecast {
namespace {

constexpr std::size_t kMaxKnown = 10'000;  // anybody may invent channels

}  // namespace

std::string ChannelFilter::Set(const std::string& expression, bool invert) {
  invert_ = invert;
  known_.clear();
  if (expression.empty())
    return invert ? "without an expression, all channels are taken: there is nothing to invert" : "";
  Result<std::regex> compiled = CompileExpression(expression);
  if (!compiled) return compiled.error().text;
  expression_ = std::move(*compiled);
  return "";
}

bool ChannelFilter::Takes(std::string_view channel) {
  if (!expression_) return true;
  if (const auto found = known_.find(channel); found != known_.end()) return found->second;
  bool takes = false;
  try {
    takes = std::regex_search(channel.begin(), channel.end(), *expression_) != invert_;
  } catch (const std::regex_error&) {
    takes = invert_;  // too complex for this name: not found in it
  }
  if (known_.size() < kMaxKnown) known_.emplace(channel, takes);
  return takes;
}

}  // namespace axlecast

#include "tools/log/channel_filter.h"

#include <utility>

#include "core/base/expression.h"

namespace axlecast {
namespace {

constexpr std::size_t kMaxKnown = 10'000;  // senders can invent any number of channels

}  // namespace

Result<> ChannelFilter::Set(const std::string& expression, bool invert) {
  if (expression.empty() && invert)
    return Failure("all channels are selected: give an expression to invert, or leave out the inversion");
  std::optional<std::regex> compiled;
  if (!expression.empty()) {
    Result<std::regex> result = CompileExpression(expression);
    if (!result) return Failure(result.error());
    compiled = std::move(*result);
  }
  expression_ = std::move(compiled);
  invert_ = invert;
  known_.clear();
  return {};
}

bool ChannelFilter::Matches(std::string_view channel) {
  if (!expression_) return true;
  if (const auto found = known_.find(channel); found != known_.end()) return found->second;
  bool matches = invert_;
  try {
    matches = std::regex_search(channel.begin(), channel.end(), *expression_) != invert_;
  } catch (const std::regex_error&) {
    // The expression is too complex for this name: it counts as not found.
  }
  if (known_.size() < kMaxKnown) known_.emplace(channel, matches);
  return matches;
}

}  // namespace axlecast

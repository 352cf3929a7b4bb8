#include "bridge/access/prepared_commands.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <utility>

namespace axlecast {
namespace {

bool SameArguments(const std::vector<argument_t>& one, const std::vector<argument_t>& other) {
  return std::equal(one.begin(), one.end(), other.begin(), other.end(),
                    [](const auto& a, const auto& b) { return a.key == b.key && a.value == b.value; });
}

Refusal Unfit(const char* text) { return {command_status_t::REASON_TOKEN, text}; }

}  // namespace

void PreparedCommands::Issue(const Token& token, Prepared prepared, MonoNs now) {
  entries_.push_back({token, std::move(prepared), now + kValid});
  if (entries_.size() > kMax) entries_.pop_front();
}

std::variant<std::int32_t, Refusal> PreparedCommands::Redeem(const command_body_t& body, const std::string& who,
                                                             MonoNs now) {
  const auto found = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) {
    return std::equal(entry.token.begin(), entry.token.end(), std::begin(body.token));
  });
  if (found == entries_.end()) {
    return Unfit("no such token: it was used, was forgotten, or is of another boot of the bridge; prepare again");
  }
  const Entry entry = std::move(*found);
  entries_.erase(found);
  const Prepared& prepared = entry.prepared;
  if (now > entry.until) return Unfit("the token was valid for 30 s: prepare again, look, and commit sooner");
  if (prepared.who != who) return Unfit("the token belongs to another key: who prepares it commits it");
  if (prepared.device != body.device || prepared.operation != body.operation ||
      !SameArguments(prepared.arguments, body.arguments)) {
    return Unfit("something else was prepared: give the same device, operation and arguments");
  }
  return prepared.epoch;
}

}  // namespace axlecast

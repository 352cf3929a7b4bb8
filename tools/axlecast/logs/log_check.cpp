#include "tools/axlecast/logs/log_check.h"

#include <algorithm>

#include "core/base/text.h"
#include "core/messages/json/message_json.h"
#include "tools/axlecast/logs/log_input.h"
#include "tools/axlecast/logs/log_summary.h"

namespace axlecast {
namespace {

constexpr std::size_t kBadSealsShown = 10;

constexpr std::uint64_t kLargestGap = 1'000'000'000'000;  // a greater gap is a damaged number

bool Follows(std::int64_t before, std::int64_t number) { return number > before && number - 1 == before; }

std::string SealText(const LogCheck::BadSeal& bad) {
  std::string text = "the seal at byte " + std::to_string(bad.offset) + " does not match: ";
  if (bad.sealed.events > bad.found.events) {
    text += std::to_string(bad.sealed.events - bad.found.events) + " of " + std::to_string(bad.sealed.events) +
            " events before it are missing\n";
  } else if (bad.sealed.events < bad.found.events) {
    text += std::to_string(bad.found.events - bad.sealed.events) + " events too many are before it\n";
  } else {
    text += "something in the " + std::to_string(bad.sealed.events) + " events before it was changed\n";
  }
  return text;
}

}  // namespace

void LogCheck::Add(const LogEvent& event, std::size_t offset, Bytes record) {
  ++events_;
  CheckNumber(event.number);
  std::int64_t back = 0;
  if (event.utime < utime_ && !__builtin_sub_overflow(utime_, event.utime, &back)) {
    ++backward_;
    max_backward_ = std::max(max_backward_, back);
  }
  utime_ = event.utime;
  if (event.channel == kSealChannel) return CheckSeal(event, offset);
  open_.Add(record);
  if (const auto head = HeadOf(event.data)) {
    auto found = sequences_.find(event.channel);
    if (found == sequences_.end()) found = sequences_.emplace(event.channel, SequenceCount{}).first;
    found->second.On(head->boot_id, head->seq);
  }
}

void LogCheck::CheckNumber(std::int64_t number) {
  if (doubtful_) ResolveDoubt(number);
  if (!number_ || Follows(*number_, number)) {
    number_ = number;
  } else {
    doubtful_ = number;
  }
}

// Decides about the number that did not follow, with the help of the next one.
void LogCheck::ResolveDoubt(std::optional<std::int64_t> next) {
  const std::int64_t doubtful = *doubtful_;
  doubtful_.reset();
  const bool ahead = doubtful > *number_;
  const std::uint64_t gap = static_cast<std::uint64_t>(doubtful) - static_cast<std::uint64_t>(*number_) - 1;
  const bool confirmed = next && Follows(doubtful, *next);
  if (ahead && gap <= kLargestGap && (confirmed || !next || *next > doubtful)) {
    missing_ += static_cast<std::int64_t>(gap);
    number_ = doubtful;
  } else if (confirmed) {
    ++restarts_;
    number_ = doubtful;
  } else {
    ++wrong_;
    if (*number_ < INT64_MAX) ++*number_;
  }
}

void LogCheck::Finish() {
  if (doubtful_) ResolveDoubt(std::nullopt);
}

void LogCheck::CheckSeal(const LogEvent& event, std::size_t offset) {
  ++seals_;
  const std::optional<LogSeal> sealed = ParseSeal(event.data);
  if (sealed != open_.seal()) {
    ++bad_seals_;
    if (first_bad_seals_.size() < kBadSealsShown) {
      first_bad_seals_.push_back({offset, sealed.value_or(LogSeal{}), open_.seal()});
    }
  }
  open_.Reset();
}

std::int64_t LogCheck::lost() const {
  std::int64_t lost = 0;
  for (const auto& [channel, sequence] : sequences_) lost += sequence.lost();
  return lost;
}

std::string CheckText(const std::string& file, const LogCheck& check,
                      const std::vector<LogReader::Damage>& damage) {
  std::string text = DamageText(file, damage);
  for (const LogCheck::BadSeal& bad : check.first_bad_seals()) text += SealText(bad);
  const auto add = [&text](std::int64_t count, const std::string& what) {
    if (count > 0) text += std::to_string(count) + what + '\n';
  };
  add(check.missing(), " events are missing by their numbers");
  add(check.wrong_numbers(), " events have a number that fits neither neighbour: damaged");
  add(check.restarts(), " times the numbers begin again: events were appended, as lcm-logger -a does");
  add(check.backward(), " events are earlier than their predecessor, at most " +
                            Decimal(static_cast<double>(check.max_backward_us()) / 1e6, 6) + " s");
  for (const auto& [channel, sequence] : check.sequences()) {
    add(sequence.lost(), " messages of " + Printable(channel) + " were lost before they were recorded");
  }
  text += file + ": " + std::to_string(check.events()) + " events, ";
  if (check.seals() == 0) {
    text += "no seals: changed content cannot be detected";
  } else {
    text += std::to_string(check.seals() - check.bad_seals()) + " of " + std::to_string(check.seals()) +
            " seals match, " + std::to_string(check.unsealed()) + " events are after the last one";
  }
  return text + (damage.empty() && check.sound() ? "; complete\n" : "; readable with losses\n");
}

nlohmann::ordered_json CheckJson(const std::string& file, const LogCheck& check,
                                 const std::vector<LogReader::Damage>& damage) {
  nlohmann::ordered_json lost = nlohmann::ordered_json::object();
  for (const auto& [channel, sequence] : check.sequences()) {
    if (sequence.lost() > 0) lost[channel] = sequence.lost();
  }
  nlohmann::ordered_json bad = nlohmann::ordered_json::array();
  for (const LogCheck::BadSeal& seal : check.first_bad_seals()) {
    bad.push_back(
        {{"offset", seal.offset}, {"events_sealed", seal.sealed.events}, {"events_found", seal.found.events}});
  }
  return {{"file", file},
          {"whole", damage.empty() && check.sound()},
          {"events", check.events()},
          {"damage", DamageJson(damage)},
          {"seals", check.seals()},
          {"bad_seals", check.bad_seals()},
          {"first_bad_seals", bad},
          {"unsealed_events", check.unsealed()},
          {"missing_events", check.missing()},
          {"wrong_numbers", check.wrong_numbers()},
          {"new_beginnings", check.restarts()},
          {"backward", check.backward()},
          {"max_backward_us", check.max_backward_us()},
          {"lost", lost}};
}

}  // namespace axlecast

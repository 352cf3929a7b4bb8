#include "core/command/commands.h"

#include <sodium.h>

#include <axlecast/command_status_t.hpp>
#include <set>

#include "core/base/text.h"

namespace axlecast {
namespace {

const OperationSpec* FindIn(std::span<const OperationSpec> operations, std::string_view name) {
  const auto found = std::find_if(operations.begin(), operations.end(),
                                  [&](const OperationSpec& operation) { return operation.name == name; });
  return found == operations.end() ? nullptr : &*found;
}

std::string TakenArguments(const OperationSpec& operation) {
  if (operation.arguments.empty()) return std::string(operation.name) + " takes no argument";
  std::string text = std::string(operation.name) + " takes ";
  for (std::size_t i = 0; i < operation.arguments.size(); ++i) {
    const ArgumentSpec& argument = operation.arguments[i];
    if (i > 0) text += ", ";
    text += std::string(argument.name) + (argument.required ? "" : " (optional)");
  }
  return text;
}

tl::unexpected<Error> BadArgument(std::string text) {
  return Failure(std::move(text), command_status_t::REASON_BAD_ARGUMENT);
}

}  // namespace

std::string IdText(const CommandId& id) { return HexDigits(id); }

std::optional<CommandId> ParseId(std::string_view text) {
  CommandId id{};
  return ParseHex(text, id) ? std::optional(id) : std::nullopt;
}

bool ParseHex(std::string_view text, std::span<std::uint8_t> bytes) {
  std::size_t parsed = 0;
  return text.size() == 2 * bytes.size() &&
         sodium_hex2bin(bytes.data(), bytes.size(), text.data(), text.size(), nullptr, &parsed, nullptr) == 0 &&
         parsed == bytes.size();
}

std::int64_t BodyDigest(Bytes body) {
  std::array<std::uint8_t, crypto_generichash_BYTES> hash;  // 32 bytes: BLAKE2b-256
  crypto_generichash(hash.data(), hash.size(), body.data(), body.size(), nullptr, 0);
  std::uint64_t digest = 0;
  for (std::size_t i = 0; i < 8; ++i) digest = digest << 8 | hash[i];
  return static_cast<std::int64_t>(digest);
}

std::span<const OperationSpec> RuntimeOperations(const Family& family) {
  static const std::vector<OperationSpec> kOperations = {
      {.name = kAcknowledgeAlarm,
       .help = "Acknowledges an alarm; nothing is cleared in the device",
       .arguments = {{"alarm", "its name in ALARM"}},
       .verification = "the next ALARM"},
      {.name = kShelveAlarm,
       .help = "Shelves an alarm for a time: it is listed as shelved; nothing is cleared in the device",
       .arguments = {{"alarm", "its name in ALARM"},
                     {"seconds", "for how long, at most 86400; give this or `until`", false},
                     {"until", "us, UNIX time of the end", false},
                     {"up_to", "info, warning, error or critical: not when it is worse; default: as it is", false}},
       .verification = "the next ALARM"},
      {.name = kUnshelveAlarm,
       .help = "Ends the shelving of an alarm before its time",
       .arguments = {{"alarm", "its name"}},
       .verification = "the next ALARM"},
      {.name = kRestoreAcknowledgement,
       .help = "Restores in a restarted driver that an alarm was acknowledged while it was present",
       .arguments = {{"alarm", "its name"}},
       .internal = true},
      {.name = "set_datum",
       .help = "Makes the present position read `value`, or makes `counts` the origin, in software; the device is "
               "not written",
       .arguments = {{"value", "what the present position shall read, in the device's unit", false},
                     {"counts", "counts after direction that shall read 0; give this or `value`", false},
                     {"utime", "us, UNIX time at which it was established; default: now", false},
                     {"identity", "refused if the encoder reports another identity: \"17\", \"17 SN0042\"", false}},
       .verification = "the next reading"},
      {.name = "clear_datum",
       .help = "Removes the datum: the axis is no longer REFERENCED; the device is not written",
       .verification = "the next reading"},
      {.name = "undo_datum",
       .help = "Restores the datum before the present one; the device is not written",
       .verification = "the next reading",
       .executed_by_bridge = true},
      {.name = "accept_exchange",
       .help = "Accepts another encoder: wear, identity and datum restart, the old datum is void",
       .destructive = true,
       .executed_by_bridge = true},
      {.name = "mark_reference_lost",
       .help = "Restores in a restarted driver that the reference was lost before",
       .verification = "the driver's HELLO",
       .internal = true},
  };
  constexpr std::size_t kOfAlarms = 4;  // the first; the others are about the datum of an axis
  const std::span<const OperationSpec> all = kOperations;
  return family.has_position ? all : all.first(kOfAlarms);
}

const OperationSpec* FindOperation(const Family& family, std::string_view name) {
  const OperationSpec* own = FindIn(family.operations, name);
  return own != nullptr ? own : FindIn(RuntimeOperations(family), name);
}

bool IsAboutAlarms(std::string_view operation) {
  return operation == kAcknowledgeAlarm || operation == kShelveAlarm || operation == kUnshelveAlarm ||
         operation == kRestoreAcknowledgement;
}

bool IsOfRuntime(const Family& family, const OperationSpec& operation) {
  const auto own = RuntimeOperations(family);
  return &operation >= own.data() && &operation < own.data() + own.size();
}

std::string OperationNames(const Family& family) {
  std::string text = "operations of " + std::string(family.name) + ":";
  const auto add = [&](std::span<const OperationSpec> operations) {
    for (const OperationSpec& operation : operations) {
      if (!operation.internal) text += " " + std::string(operation.name);
    }
  };
  add(family.operations);
  add(RuntimeOperations(family));
  return text;
}

Result<> CheckArguments(const OperationSpec& operation, std::span<const argument_t> arguments) {
  std::set<std::string_view> given;
  for (const argument_t& argument : arguments) {
    const auto& known = operation.arguments;
    const std::string key = CappedText(argument.key, kNameBytes);
    if (std::none_of(known.begin(), known.end(), [&](const auto& spec) { return spec.name == argument.key; })) {
      return BadArgument("unknown argument " + key + ": " + TakenArguments(operation));
    }
    if (!given.insert(argument.key).second) return BadArgument("argument " + key + " is given twice: give it once");
    if (argument.value.size() > kArgumentBytes) {
      return BadArgument("the value of " + key + " has " + std::to_string(argument.value.size()) +
                         " bytes: at most " + std::to_string(kArgumentBytes));
    }
  }
  for (const ArgumentSpec& spec : operation.arguments) {
    if (spec.required && !given.contains(spec.name)) {
      return BadArgument("argument " + std::string(spec.name) + " is missing: " + TakenArguments(operation));
    }
  }
  return {};
}

}  // namespace axlecast

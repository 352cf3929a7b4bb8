#include "drivers/tformat/settings.h"

#include <algorithm>
#include <array>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "drivers/kit/command_runner.h"

namespace axlecast::tformat {

namespace {

constexpr std::array<Model, 2> kModels = {{
    // TS5669 spec 5.4.1, 5.4.2 and 6.3.3.
    {"ts5669n127", {.single_turn_bits = 17, .multi_turn_bits = 16}, 0x11, 6'000, 80'000},
    // Known from public captures only (golden/captures.txt); its mechanical limits are taken to be the TS5669's.
    {"smart_abs_23", {.single_turn_bits = 23, .multi_turn_bits = 16}, 0x17, 6'000, 80'000},
}};

// Spec 5.4.1, "Adjoining pitch error", either way: the largest difference of two readings of the same place, 4 counts of
// 2^17. Taken as the same angle for every model.
constexpr int kPitchErrorArcSeconds = 40;

}  // namespace

std::span<const Model> Models() { return kModels; }

const Model* FindModel(std::string_view name) {
  const auto* found = std::find_if(kModels.begin(), kModels.end(), [&](const Model& m) { return m.name == name; });
  return found == kModels.end() ? nullptr : found;
}

std::int64_t ZeroToleranceCounts(int single_turn_bits) {
  return static_cast<std::int64_t>(kZeroToleranceDeg / 360 *
                                   static_cast<double>(std::int64_t{1} << single_turn_bits));
}

bool TurnsAreReset(const Reply& all, const TFormatSettings& settings) {
  const std::uint32_t turns = *all.multi_turn;
  if (turns == 0) return true;
  if (!IsZero(all, settings)) return false;
  const std::uint32_t last = (1U << static_cast<unsigned>(settings.format.multi_turn_bits)) - 1;
  const bool low_half = *all.single_turn < settings.counts_per_turn / 2;
  return low_half ? turns == 1 : turns == last;
}

bool IsZero(const Reply& all, const TFormatSettings& settings) {
  return CircularDistance(*all.single_turn, 0, settings.counts_per_turn) <=
         ZeroToleranceCounts(settings.format.single_turn_bits);
}

namespace {

// Above the 16 ms that a USB adapter's latency timer holds a reply back by default.
constexpr std::int64_t kDefaultTimeoutUs = 20'000;
// Above the 1 ms to which that timer should be set.
constexpr std::int64_t kDefaultSilenceUs = 2'000;
// The longest reply and its delay take 47 us (TS5669 spec 6.2, 7.1).
constexpr std::int64_t kMinSilenceUs = 50;
constexpr std::int64_t kDefaultId3Every = 10;
// "Total 100,000 times" (TS5669 spec 6.1.1): the user's cells and the stored zero (spec 9: ID 8) together.
constexpr std::int64_t kRewrites = 100'000;

void UseModel(const Model& model, TFormatSettings& settings) {
  settings.format = model.format;
  settings.encoder_id = model.encoder_id;
  settings.max_speed_rpm = model.max_speed_rpm;
  settings.max_accel_rad_s2 = model.max_accel_rad_s2;
}

void ParseModel(ConfigMap& device, TFormatSettings& settings) {
  std::vector<std::string_view> names;
  for (const Model& model : Models()) names.push_back(model.name);
  names.push_back(kCustomModel);
  device.Require("model", std::string(names[0]) + ", or custom with bits, turn_bits and enid");
  const std::size_t choice = device.Choice("model", names, 0);
  settings.model = names[choice];
  UseModel(Models()[choice < Models().size() ? choice : 0], settings);
  const bool custom = settings.model == kCustomModel;
  for (const char* key : {"bits", "turn_bits", "enid"}) {
    if (custom && !device.Has(key)) device.Error(key, "is missing: model custom needs it");
    if (!custom && device.Has(key))
      device.Error(key, "is known of model " + settings.model + ": only custom takes it");
  }
  const auto own = [&](const char* key, int fallback, int min, int max, const char* unit) {
    return custom ? static_cast<int>(device.Integer(key, fallback, min, max, unit)) : fallback;
  };
  settings.format.single_turn_bits = own("bits", settings.format.single_turn_bits, 8, 24, "bits");
  settings.format.multi_turn_bits = own("turn_bits", settings.format.multi_turn_bits, 0, 24, "bits");
  settings.encoder_id = static_cast<std::uint8_t>(own("enid", settings.encoder_id, 0, 255, ""));
}

void ParsePlan(ConfigMap& device, TFormatSettings& settings) {
  settings.plan = device.Choice("plan", {"id3", "id0"}, 0) == 0 ? Plan::kAll : Plan::kSingleTurn;
  if (settings.plan == Plan::kAll && device.Has("id3_every")) {
    device.Error("id3_every", "has no effect with plan id3, which reads ID 3 in every slot: leave it out");
  }
  settings.id3_every = static_cast<int>(device.Integer("id3_every", kDefaultId3Every, 2, 10'000, "slots"));
  if (settings.plan == Plan::kAll) settings.id3_every = 1;
}

void ParseIdentity(ConfigMap& device, TFormatSettings& settings) {
  ConfigMap map = device.Map("identity");
  if (device.Has("identity")) {
    IdentityTag tag;
    for (const char* key : {"eeprom_address", "bytes"}) {
      if (!map.Has(key)) map.Error(key, "is missing: identity: {eeprom_address: 72, bytes: \"A1 05\"}");
    }
    tag.address = static_cast<std::uint8_t>(map.Integer("eeprom_address", 0, 0, kEepromCells - 1, ""));
    tag.bytes = map.HexBytes("bytes");
    if (tag.address + tag.bytes.size() > kEepromCells) {
      map.Error("bytes", std::to_string(tag.bytes.size()) + " bytes from address " + std::to_string(tag.address) +
                             " do not fit the cells 0 to 79");
    } else if (!tag.bytes.empty()) {
      settings.identity = std::move(tag);
    }
  }
  map.Done();
}

}  // namespace

void CheckLine(ConfigMap& bus_map, const BusConfig& bus) {
  ConfigMap link = bus_map.Map("link");
  if (bus.link.line.parity != Parity::kNone) link.Error("parity", "T-format has no parity bit: leave the key out");
  if (bus.link.line.stop_bits != 1) link.Error("stop_bits", "T-format has one stop bit: leave the key out");
}

std::unique_ptr<TFormatSettings> ParseSettings(ConfigMap& device, const LineFormat& line) {
  auto settings = std::make_unique<TFormatSettings>();
  ParseModel(device, *settings);
  settings->battery = device.Bool("battery", true);
  settings->counts_per_turn = std::int64_t{1} << settings->format.single_turn_bits;
  const int turn_bits = settings->format.multi_turn_bits;
  settings->turns_range = settings->battery && turn_bits > 0 ? std::int64_t{1} << turn_bits : 0;
  settings->noise_counts = NoiseOfAccuracy(kPitchErrorArcSeconds, settings->format.single_turn_bits);
  settings->write_budget = kRewrites;
  ParsePlan(device, *settings);
  ParseIdentity(device, *settings);
  settings->timeout = device.Integer("timeout_us", kDefaultTimeoutUs, 100, 1'000'000,
                                     "us, longer than the adapter's latency timer") *
                      kMicrosecond;
  settings->reply_timeout = settings->timeout;
  settings->silence = device.Integer("silence_us", kDefaultSilenceUs, kMinSilenceUs, 1'000'000,
                                     "us, longer than the adapter's latency timer") *
                      kMicrosecond;
  for (const std::int64_t cell : device.Integers("eeprom_writable", 0, kEepromCells - 1)) {
    settings->eeprom_writable.set(static_cast<std::size_t>(cell));
  }
  const MonoNs all = line.WireTime(1 + ReplySize(DataId::kAll)) + kReplyDelay;
  const MonoNs single = line.WireTime(1 + ReplySize(DataId::kSingleTurn)) + kReplyDelay;
  // When it samples is stated nowhere: between the end of the request and the begin of the reply.
  settings->latch_after = line.WireTime(1) + kReplyDelay / 2;
  settings->wire_time = (all + (settings->id3_every - 1) * single) / settings->id3_every;
  return settings;
}

}  // namespace axlecast::tformat

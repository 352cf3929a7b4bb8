#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/device/device.h"
#include "drivers/tformat/settings.h"

namespace axlecast::tformat {

// Whether the encoder that answers is the configured one: its model by ENID and, where the configuration names a
// tag, the unit by bytes of its user EEPROM. Nothing is published before it is accepted. One damaged reply convicts
// nobody: an encoder is refused when three readings in a row say so.
class IdentityCheck {
 public:
  static constexpr int kConfirmations = 3;
  // A refused tag is read again after this time: somebody may have connected the right encoder.
  static constexpr MonoNs kRecheck = 1 * kSecond;

  IdentityCheck(const TFormatSettings& settings, DeviceOutput& output);

  // Another encoder may be there now: everything must be read again.
  void Forget();
  void OnEncoderId(std::uint8_t encoder_id, MonoNs now);
  // A cell as an ID D reply shows it.
  void OnCell(std::uint8_t address, std::uint8_t data, MonoNs now);

  [[nodiscard]] bool accepted() const { return state_ == State::kAccepted; }
  [[nodiscard]] bool refused() const { return refused_; }
  // The cell to be read next so that the tag can be judged.
  [[nodiscard]] std::optional<std::uint8_t> WantedCell() const;

 private:
  enum class State : std::uint8_t { kUnknown, kReadingTag, kAccepted, kWrongModel, kWrongUnit };

  void Identify(std::uint8_t encoder_id);
  void JudgeTag(MonoNs now);
  void ReadTag();
  void Accept(MonoNs now);
  void Refuse(std::string_view reason, MonoNs now);

  const TFormatSettings& settings_;
  DeviceOutput& output_;
  State state_ = State::kUnknown;
  bool refused_ = false;  // told to the outside, until an encoder is accepted
  MonoNs refused_at_ = 0;
  std::uint8_t wrong_id_ = 0;
  int wrong_ids_ = 0;  // readings in a row that showed wrong_id_
  std::optional<std::uint8_t> reported_id_;
  std::vector<std::optional<std::uint8_t>> tag_;  // as read, byte by byte
  int wrong_tags_ = 0;                            // readings of the whole tag in a row
};

}  // namespace axlecast::tformat

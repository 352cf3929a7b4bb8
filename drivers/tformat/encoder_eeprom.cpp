#include "drivers/tformat/encoder_eeprom.h"

namespace axlecast::tformat {

void EncoderEeprom::Advance(MonoNs now) {
  if (!under_way_ || Busy(now)) return;
  cells_.at(under_way_->cell) = under_way_->data;
  under_way_.reset();
  ++writes_done_;
}

bool EncoderEeprom::Wear(MonoNs now) {
  busy_until_ = now + kWriteTime;
  if (wear_ >= kRewrites) return false;
  ++wear_;
  return true;
}

void EncoderEeprom::Write(std::uint8_t cell, std::uint8_t data, MonoNs now) {
  if (Wear(now)) {
    under_way_ = CellWrite{cell, data};
  } else {
    ++writes_lost_;
  }
}

bool EncoderEeprom::StoreZero(MonoNs now) { return Wear(now); }

void EncoderEeprom::PowerOff(MonoNs now) {
  Advance(now);
  if (under_way_) ++writes_lost_;
  under_way_.reset();
  busy_until_ = now;
}

}  // namespace axlecast::tformat

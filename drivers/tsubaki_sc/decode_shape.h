#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "core/base/inline_bytes.h"
#include "drivers/protocol/modbus/adu.h"

namespace axlecast::tsubaki_sc {

// What kind of frame one is, by its function and length alone (guideline 4 to 6, 12).
struct Shape {
  enum class Form : std::uint8_t {
    kUnknown,
    kReadRequest,
    kReadReply,
    kSingleWrite,  // request and reply are the same bytes
    kMultipleWrite,
    kMultipleReply,
    kVersionRequest,
    kVersionReply,
    kError
  };
  Form form = Form::kUnknown;
  std::string kind = "unknown";
  std::size_t size = 0;      // that it must have
  modbus::Function space{};  // which addresses, by the function that reads them

  [[nodiscard]] bool is_request() const;  // a single write counts as one
  [[nodiscard]] bool is_write() const { return form == Form::kSingleWrite || form == Form::kMultipleWrite; }
  [[nodiscard]] bool is_bits() const;
};

// Of at least 2 bytes. Request and reply of a read can be told because no reply has a request's 8 bytes: registers
// have an even number of bytes, and no two bits stand side by side.
[[nodiscard]] Shape ShapeOf(Bytes frame);

}  // namespace axlecast::tsubaki_sc

#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/inline_bytes.h"
#include "tools/foxglove/lcm_definition.h"

namespace axlecast {

// An LCM type as viewers of ROS 2 messages read it: a text of fields (ros2msg), and messages in CDR (DDS-XTypes 1.3, 7.4.1, plain CDR
// version 1, little-endian).
//
// - A type with a field utime begins with `std_msgs/Header header`, whose stamp is utime, so that a viewer has the time of the message.
// - The fields keep their names. byte is uint8, boolean bool. An array of several dimensions is one list, the last index first.
// - A type with constants FLAG_* and a field flags has a Boolean field for each of them: FLAG_VALID is flag_valid.
class RosSchema {
 public:
  // `type`: of `definitions`, which must outlive the object.
  RosSchema(const LcmDefinitions& definitions, const LcmStruct& type);

  [[nodiscard]] const std::string& name() const { return name_; }  // "axlecast/msg/Position"
  [[nodiscard]] const std::string& text() const { return text_; }

  // Appends an encoded LCM message in CDR. Returns false if the message is cut, has more bytes than its type, or a size that is not
  // possible: then `cdr` is unspecified.
  [[nodiscard]] bool Transcode(Bytes message, std::string& cdr) const;
  // Returns utime, us, of an encoded LCM message; 0 if its type has no such field at its beginning.
  [[nodiscard]] std::int64_t UtimeOf(Bytes message) const;

 private:
  struct Flag {
    std::string name;
    std::uint32_t bit = 0;
  };

  [[nodiscard]] std::string NameOf(const std::string& full_name) const;
  void Describe(const LcmStruct& type, std::vector<std::string>& described);

  const LcmDefinitions& definitions_;
  const LcmStruct& type_;
  std::string name_;
  std::string text_;
  bool has_utime_ = false;
  std::size_t flags_field_ = 0;
  std::vector<Flag> flags_;
};

}  // namespace axlecast

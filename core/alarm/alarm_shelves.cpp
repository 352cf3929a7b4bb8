#include "core/alarm/alarm_shelves.h"

#include <algorithm>
#include <utility>

namespace axlecast {

const AlarmShelves::Shelf* AlarmShelves::Find(std::string_view alarm) const {
  const auto found =
      std::find_if(shelves_.begin(), shelves_.end(), [alarm](const Shelf& shelf) { return shelf.alarm == alarm; });
  return found == shelves_.end() ? nullptr : &*found;
}

void AlarmShelves::Put(Shelf shelf) {
  static_cast<void>(Remove(shelf.alarm));
  shelves_.push_back(std::move(shelf));
}

bool AlarmShelves::Remove(std::string_view alarm) {
  return std::erase_if(shelves_, [alarm](const Shelf& shelf) { return shelf.alarm == alarm; }) > 0;
}

bool AlarmShelves::Expire(std::int64_t utime) {
  return std::erase_if(shelves_, [utime](const Shelf& shelf) {
           return shelf.until_utime <= utime || shelf.until_utime - utime > kLongestUs;
         }) > 0;
}

bool AlarmShelves::Hides(const AlarmSpec& alarm) const {
  const Shelf* const shelf = Find(alarm.name);
  return shelf != nullptr && alarm.severity <= shelf->up_to;
}

}  // namespace axlecast

#include "core/config/load_place.h"

#include "core/base/words.h"

namespace axlecast {

SecretPlace LoadPlace(ConfigMap& map, const std::string& example) {
  SecretPlace place;
  place.file = map.String("file", "");
  place.credential = map.String("credential", "");
  if (!place.file.empty() && !place.credential.empty()) {
    map.Error("credential", "stands beside file: it is read from one of them; leave the other out");
  }
  if (map.Has("file") && !place.file.starts_with('/')) {
    map.Error("file", Quoted(place.file) + " is no absolute path, e.g. " + example);
  }
  if (map.Has("credential") && (place.credential.empty() || place.credential.find('/') != std::string::npos)) {
    map.Error("credential", Quoted(place.credential) + " is no name below $CREDENTIALS_DIRECTORY, without '/'");
  }
  return place;
}

}  // namespace axlecast

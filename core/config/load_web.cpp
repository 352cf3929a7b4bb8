#include "core/config/load_web.h"

#include "core/base/words.h"
#include "core/config/load_place.h"

namespace axlecast {
namespace {

std::string LoadPem(ConfigMap& map, const char* key) {
  std::string file = map.String(key, "");
  if (map.Has(key) && !file.starts_with('/')) {
    map.Error(key, Quoted(file) + " is no absolute path, e.g. /etc/axlecast/" + key + ".pem");
  }
  return file;
}

}  // namespace

WebConfig LoadWeb(ConfigMap map) {
  WebConfig web;
  web.bind = map.String("bind", web.bind);
  web.port = static_cast<int>(map.Integer("port", web.port, 1, 65535, "(TCP)"));
  web.certificate = LoadPem(map, "tls_cert");
  web.key = LoadPem(map, "tls_key");
  if (map.Has("token")) {
    ConfigMap token = map.Map("token");
    web.token = LoadPlace(token, "/etc/axlecast/web.token");
    web.token.group_may_read = true;
    token.Done();
  }
  web.names = map.Strings("names");
  for (const WebFault& fault : FaultsOf(web)) map.Error(fault.key, fault.text);
  map.Done();
  return web;
}

}  // namespace axlecast

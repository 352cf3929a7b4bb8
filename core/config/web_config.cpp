#include "core/config/web_config.h"

#include <arpa/inet.h>

#include "core/base/spelling.h"
#include "core/config/config_map.h"

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

bool IsLoopback(const std::string& address) {
  in_addr v4{};
  in6_addr v6{};
  if (inet_pton(AF_INET, address.c_str(), &v4) == 1) return ntohl(v4.s_addr) >> 24U == 127;
  return inet_pton(AF_INET6, address.c_str(), &v6) == 1 && IN6_IS_ADDR_LOOPBACK(&v6);
}

std::string WebUrl(const WebConfig& web, const std::string& host) {
  const bool any = web.bind == "0.0.0.0" || web.bind == "::";
  const bool v6 = web.bind.find(':') != std::string::npos;
  const std::string name = any ? host : v6 ? '[' + web.bind + ']' : web.bind;
  return (web.certificate.empty() ? "http://" : "https://") + name + ':' + std::to_string(web.port) + '/';
}

std::vector<WebFault> FaultsOf(const WebConfig& web) {
  std::vector<WebFault> faults;
  in_addr v4{};
  in6_addr v6{};
  const bool numeric =
      inet_pton(AF_INET, web.bind.c_str(), &v4) == 1 || inet_pton(AF_INET6, web.bind.c_str(), &v6) == 1;
  if (!numeric) faults.push_back({"bind", Quoted(web.bind) + " is no address, e.g. 127.0.0.1, ::1 or 0.0.0.0"});
  if (web.certificate.empty() != web.key.empty()) {
    faults.push_back({web.key.empty() ? "tls_cert" : "tls_key",
                      std::string("needs ") + (web.key.empty() ? "tls_key" : "tls_cert") + " beside it"});
  }
  if (!numeric || IsLoopback(web.bind)) return faults;
  const std::string why = Quoted(web.bind) + " is reached from other hosts: ";
  if (web.certificate.empty()) faults.push_back({"bind", why + "needs tls_cert and tls_key"});
  if (web.token.empty()) faults.push_back({"bind", why + "needs a token"});
  return faults;
}

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

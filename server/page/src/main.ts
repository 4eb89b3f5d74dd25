// The page of a server: a live world, or a recording that the server plays.
import { Connection } from "./world/connection";
import { startPage } from "./page";

const TOKEN_KEY = "enfilade token";

/** A token in the address is remembered for this tab and removed from the address. */
function takeToken(): string {
  const address = new URL(location.href);
  const given = address.searchParams.get("token");
  if (given !== null) {
    sessionStorage.setItem(TOKEN_KEY, given);
    address.searchParams.delete("token");
    history.replaceState(null, "", address);
  }
  return sessionStorage.getItem(TOKEN_KEY) ?? "";
}

const token = takeToken();
const world = new URLSearchParams(location.search).get("world") ?? "";
startPage({
  makeSource: (listener) => new Connection(listener, token, world),
  rememberToken: (given) => sessionStorage.setItem(TOKEN_KEY, given),
});

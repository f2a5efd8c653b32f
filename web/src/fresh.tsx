// Whether what is shown is how the plant is: said before everything else where it is not.

import type { Player } from "./player";
import type { Run } from "./told";
import { moment, span } from "./words";

export function Freshness({ run, player }: { run: Run; player: Player }) {
  const now = player.now, fresh = now?.fresh;
  if (!run.attached || !now || !fresh) return null;
  if (player.silent_s || player.lost) {
    return <p class="stale" role="alert"><b>■ Old data.</b> The console does not answer{player.silent_s > 0 && ` for ${span(player.silent_s)}`}:
      this is how it was at {moment(now.at_s)}. The guard goes on without this page; the page goes on by itself.</p>;
  }
  if (!player.playing) return <p class="notice calm" role="status">△ Not live: this is how it was at {moment(now.at_s)}.</p>;
  if (fresh.old) {
    return <p class="stale" role="alert"><b>■ Old data{fresh.age_s === null ? "" : `, ${span(fresh.age_s)} old`}.</b> {fresh.trouble}.
      Nothing here says how the plant is now.</p>;
  }
  if (fresh.thinking) return <p class="notice" role="status">△ Nobody thinks about the plant: {fresh.thinking}. Limits are watched all the same.</p>;
  return null;
}

"use strict";
// Calls `tell` whenever there is something new, until descry has ended; it says whether there was something to tell, and `done` waits
// for what comes behind it. What is known of the connection stands in the line `live`.
function follow(tell, done) {
  const news = new EventSource("news"), pause = () => new Promise(over => setTimeout(over, 300));
  const state = words => { const line = document.getElementById("live"); line.hidden = false; line.textContent = words; };
  const lost = "descry does not answer any more; this is what it said last";
  let last = null, telling = false;
  news.onmessage = async event => {
    last = JSON.parse(event.data);
    if (telling) return;
    telling = true;
    for (let told = null; told !== last; await pause()) {
      told = last;
      const was = await tell(told.ended);
      state(was ? "live: this page follows what goes on" : "live: there is nothing to be seen yet");
      if (!told.ended) continue;
      await done();
      news.close();
      state(was ? "descry has ended; this page shows all that it did, and stays" : lost);
      break;
    }
    telling = false;
  };
  news.onerror = () => state(lost);
}

"use strict";
// Shows the cards that the form asks for, in its order. Without scripts all are shown.
(() => {
  const form = document.getElementById("filters");
  const list = document.querySelector(".cards");
  const cards = [...list.children];

  function fits(card) {
    const wanted = form.elements.find.value.trim().toLowerCase();
    return card.dataset.find.toLowerCase().includes(wanted) &&
      ["object", "family", "verdict"].every(
        (name) => !form.elements[name].value || form.elements[name].value === card.dataset[name]);
  }

  function place(card, order) {
    const name = order.replace("-", "");
    const value = parseFloat(card.dataset[name]);
    if (Number.isNaN(value)) return Infinity;
    return order.startsWith("-") ? -value : value;
  }

  function update() {
    const order = form.elements.order.value;
    let shown = 0, all = 0;
    for (const card of cards) {
      card.hidden = !fits(card);
      all += +card.dataset.count;
      shown += card.hidden ? 0 : +card.dataset.count;
    }
    const sorted = [...cards].sort((a, b) =>
      place(a, order) - place(b, order) || a.dataset.place - b.dataset.place);
    list.append(...sorted);
    form.querySelector("output").value = `${shown} of ${all} grasps`;
  }

  form.addEventListener("input", update);
  form.addEventListener("submit", (event) => event.preventDefault());
  form.hidden = false;
  update();
})();
